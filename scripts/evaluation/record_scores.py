"""Scores of every synthesised record against the actual one."""

from cospeech.data import tables as files
from cospeech.evaluation import scores
from cospeech.workflow import job

with job.run(snakemake) as work:
    actors = work.params["actors"]
    synthesised = scores.of_draws(
        (work.read(path, "planned_phrases") for path in [*work.input.planned, *work.input.swept]), "planned"
    ) | scores.of_draws((work.read(path, "planned_phrases") for path in work.input.seen_draws), "seen")
    for system in work.params["apart"]:  # one that failed planned nothing
        synthesised.setdefault(scores.Scored(*system), files.empty("segments"))
    for system, path in zip(work.params["seen"], work.input.seen, strict=True):
        synthesised[scores.Scored(*system, "seen")] = work.read(path, "segments")
    table = scores.table(
        synthesised,
        work.read_each(list(actors), work.input.actual, "segments"),
        actors,
        scores.Rules(**work.params["rules"]),
        work.params["decoders"],
    )
    if work.input.motion:
        table = scores.with_motion(table, [work.read(path, "motion_scores") for path in work.input.motion], actors)
    work.write(table, work.output.scores, "record_scores")
