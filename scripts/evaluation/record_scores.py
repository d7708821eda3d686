"""Scores of every synthesised record against the actual one."""

from cospeech.evaluation import scores
from cospeech.workflow import job

with job.run(snakemake) as work:
    actors = work.params["actors"]
    table = scores.table(
        [scores.Scored(*one) for one in work.params["scored"]],
        [work.read(path, "segments") for path in work.input.synthesised],
        work.read_each(list(actors), work.input.actual, "segments"),
        actors,
        scores.Rules(**work.params["rules"]),
    )
    work.write(table, work.output.scores, "record_scores")
