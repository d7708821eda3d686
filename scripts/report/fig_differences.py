"""Which differences between systems the corpus can resolve."""

from cospeech.report import leaderboard, output, style
from cospeech.workflow import job

with job.run(snakemake) as work:
    given = work.params
    differences = work.read(work.input.differences, "differences")
    table = leaderboard.pairs(differences, given["systems"], "interior", given["bin_s"])
    figure = leaderboard.difference_figure(table, given["systems"], given["measures"])
    style.save(figure, work.output.svg, work.output.png)
    output.save_table(table, work.output.table)
