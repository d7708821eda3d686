"""Scores of every synthesised record against the actual one."""

import pandas as pd

from cospeech.evaluation import scores
from cospeech.workflow import job

with job.run(snakemake) as work:
    actors = work.params["actors"]
    rules = scores.Rules(**work.params["rules"])
    actual = {
        record: scores.phrases(work.read(path, "segments"), rules)
        for record, path in zip(actors, work.input.actual, strict=True)
    }
    rows = []
    for (system, clusters, states, record), path in zip(work.params["scored"], work.input.synthesised, strict=True):
        origin = {"system": system, "clusters": clusters, "states": states, "actor": actors[record], "record": record}
        synthesised = scores.phrases(work.read(path, "segments"), rules)
        rows += [origin | row for row in scores.record_scores(actual[record], synthesised, rules)]
    work.write(pd.DataFrame(rows), work.output.scores, "record_scores")
