"""How fast the hands move, originally and synthesised."""

from cospeech.report import motion, output, style
from cospeech.workflow import job

with job.run(snakemake) as work:
    summary = motion.distances(work.read(work.input.statistics, "motion_statistics"))
    histograms = work.read(work.input.histograms, "motion_histograms")
    figure = motion.figure(histograms, summary, work.params["titles"])
    style.save(figure, work.output.svg, work.output.png)
    output.save_table(summary, work.output.table)
