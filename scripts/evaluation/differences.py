"""Differences of every two systems at the main setting, paired by record."""

from cospeech import job
from cospeech.evaluation import sessions

with job.run(snakemake) as work:
    bootstrap = sessions.Bootstrap(**work.params["bootstrap"], seed=work.params["seed"])
    scores = work.read(work.input.scores, "record_scores")
    table = sessions.differences(scores, work.params["clusters"], work.params["states"], bootstrap)
    work.write(table, work.output.differences, "differences")
