"""What the weighted HSMM scores where the true joint angles of one actor take the place of those from the films."""

import pandas as pd

from cospeech.evaluation import scores
from cospeech.segmentation import gesture
from cospeech.synthesis import hsmm, hsmm_weighted
from cospeech.synthesis.fold import fold
from cospeech.synthesis.speech import frame_labels, heard
from cospeech.workflow import job

with job.run(snakemake) as work:
    given, frame_s, censoring = work.params, work.params["frame_s"], work.params["censoring"]
    how, rules = hsmm.Estimate(**given["estimate"]), scores.Rules(**given["rules"])
    motions = {
        record: work.read(path, "motion") for record, path in zip(given["records"], work.input.motion, strict=True)
    }
    examples = work.read(work.input.annotations, "annotations")

    def phrases(others):
        """The gesture phrases of some records, by a model that saw these records only."""
        seen = {record: motions[record] for record in others}
        model = gesture.train(seen, examples[examples["record"].isin(others)], given["settings"]).model
        return pd.concat([gesture.phrases(model, record, motion, examples) for record, motion in seen.items()])

    actual, rows = phrases(motions), []
    for record, path in zip(motions, work.input.prosody, strict=True):
        prosody = work.read(path, "segments")
        known = fold(record, phrases([other for other in motions if other != record]), prosody, frame_s)
        counted = hsmm.counts(known, how)
        weight = hsmm_weighted.choose_weight(known, counted, how, given["weights"], censoring)
        speech = heard(frame_labels(prosody), record, frame_s)
        made = hsmm.synthesise(hsmm.train(counted.values(), how), speech, weight, censoring)
        origin = {"system": "hsmm_weighted", **given["setting"], "actor": work.wildcards.actor, "record": record}
        own = scores.phrases(actual[actual["record"] == record], rules)
        rows += [origin | row for row in scores.record_scores(own, scores.phrases(made.phrases, rules), rules)]
    work.write(pd.DataFrame(rows), work.output.scores, "record_scores")
