"""Scores of every synthesised record against the actual one."""

from cospeech.evaluation import scores
from cospeech.workflow import job

with job.run(snakemake) as work:
    actors = work.params["actors"]
    synthesised = scores.planned(
        work.read(path, "planned_phrases") for path in [*work.input.planned, *work.input.swept]
    )
    for one, path in zip(work.params["others"], work.input.others, strict=True):
        synthesised[scores.Scored(*one)] = work.read(path, "segments")
    table = scores.table(
        synthesised,
        work.read_each(list(actors), work.input.actual, "segments"),
        actors,
        scores.Rules(**work.params["rules"]),
    )
    work.write(table, work.output.scores, "record_scores")
