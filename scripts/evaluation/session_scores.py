"""Scores of synthesis sessions, means over an actor's records, and differences of every two systems."""

from cospeech.evaluation import sessions
from cospeech.workflow import job

with job.run(snakemake) as work:
    bootstrap = sessions.Bootstrap(**work.params["bootstrap"], seed=work.params["seed"])
    scores = work.read(work.input.scores, "record_scores")
    work.write(sessions.session_scores(scores, bootstrap), work.output.scores, "session_scores")
    differences = sessions.differences(scores, work.params["main"], bootstrap)
    work.write(differences, work.output.differences, "differences")
