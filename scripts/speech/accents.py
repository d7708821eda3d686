"""Recognise the pitch accents among syllables with each set of features, in as many accents as the document has, and
all."""

import numpy as np
import pandas as pd

from cospeech.markov.mixture_hmm import Training
from cospeech.speech import accents
from cospeech.workflow import job

with job.run(snakemake) as work:
    syllables = work.read(work.input.events, "direction_events").query("tier == 'syllable'")
    features = work.read(work.input.features, "accent_features")
    settings, training = accents.Settings(**work.params["accents"]), Training(**work.params["training"])
    every = int((syllables["label"] == accents.ACCENT).sum())
    found = []
    for labelled in sorted({min(settings.labelled, every), every}):
        given = accents.syllables(syllables, features, labelled)
        for method, columns in accents.FEATURES.items():
            decided = accents.recognise(given, features, columns, settings, training, work.params["seed"])
            table = pd.DataFrame(given).rename(columns={"recording": "record", "label": "actual"})
            found.append(
                table.assign(
                    task="accents",
                    method=method,
                    setting=np.int64(labelled),
                    portion="test",
                    start_s=table["first"] * accents.STEP_S,
                    end_s=table["end"] * accents.STEP_S,
                    label=decided,
                ).drop(columns=["first", "end"])
            )
    work.write(found, work.output.detections, "direction_detections")
