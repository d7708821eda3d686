"""Smoothing filters tried on a joint angle."""

from cospeech.report import motion, output, style
from cospeech.workflow import job

with job.run(snakemake) as work:
    trial = work.read(work.input.trial, "smoothing_trial")
    style.save(motion.smoothing_figure(trial), work.output.svg, work.output.png)
    output.save_table(trial, work.output.table)
