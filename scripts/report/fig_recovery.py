"""What of the studio's plan was found again."""

from cospeech.report import output, recovery, style
from cospeech.workflow import job

with job.run(snakemake) as work:
    clusters, states = work.params["clusters"], work.params["states"]
    table = work.read(work.input.recovery, "recovery")
    style.save(recovery.figure(table), work.output.svg, work.output.png)
    output.save_table(recovery.summary(table, clusters, states), work.output.table)
