"""All systems on all measures."""

from cospeech.report import leaderboard, output, style
from cospeech.workflow import job

with job.run(snakemake) as work:
    given = work.params
    scores = work.read(work.input.scores, "session_scores")
    at_main = leaderboard.at_main(scores, given["clusters"], given["states"])
    board = leaderboard.table(at_main, given["systems"])
    style.save(leaderboard.figure(board, given["systems"]), work.output.svg, work.output.png)
    output.save_table(board, work.output.table)
