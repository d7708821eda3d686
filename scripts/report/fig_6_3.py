"""Smoothing filters tried on a joint angle."""

from cospeech import job
from cospeech.report import motion, output, style

with job.run(snakemake) as work:
    trial = work.read(work.input.trial, "smoothing_trial")
    style.save(motion.smoothing_figure(trial), work.output.svg, work.output.png)
    output.save_table(trial, work.output.table)
