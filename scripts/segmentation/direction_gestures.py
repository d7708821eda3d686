"""Recognise the gestures of hands and head in the tested answers, with models of several numbers of states."""

import numpy as np
import pandas as pd

from cospeech.markov.mixture_hmm import Training
from cospeech.segmentation import gesture_spotting
from cospeech.workflow import job

with job.run(snakemake) as work:
    records = work.read(work.input.records, "direction_records")
    events = work.read(work.input.events, "direction_events")
    movement = dict(iter(work.read(work.input.movement, "direction_movement").groupby("record", sort=False)))
    settings, fps, seed = work.params["gestures"], work.params["fps"], work.params["seed"]
    training = Training(**work.params["training"])
    is_tested = records["portion"] == "test"
    known, tested = records[~is_tested]["record"].tolist(), records[is_tested]["record"].tolist()
    hands = {name: gesture_spotting.hand_features(table) for name, table in movement.items()}
    heads = {name: gesture_spotting.head_features(table, fps) for name, table in movement.items()}
    own = {
        (tier, part): gesture_spotting.segments(events[(events["tier"] == tier) & events["record"].isin(names)], fps)
        for tier in ("hand", "head")
        for part, names in (("known", known), ("tested", tested))
    }
    asked, states = own["hand", "tested"], settings["hand_states"]
    labels = gesture_spotting.classify(hands, own["hand", "known"], asked, states, training, seed)
    found = [
        ("hand", states, segment._replace(label=label), segment.label)
        for segment, label in zip(asked, labels, strict=True)
    ]
    for states in settings["head_states"]:
        spotted = gesture_spotting.spot(heads, own["head", "known"], tested, states, fps, training, seed)
        found += [("head", states, segment, None) for segment in spotted]
    rows = [
        (task, "HMM", np.int64(states), "test", one.recording, one.first / fps, one.end / fps, one.label, actual)
        for task, states, one, actual in found
    ]
    columns = ["task", "method", "setting", "portion", "record", "start_s", "end_s", "label", "actual"]
    work.write(pd.DataFrame(rows, columns=columns), work.output.detections, "direction_detections")
