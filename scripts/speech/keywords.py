"""Spot keywords in the tested answers, and before in a part of the training answers, with models of several sizes."""

import numpy as np

from cospeech.markov.mixture_hmm import Training
from cospeech.speech import keywords, mfcc
from cospeech.workflow import job

with job.run(snakemake) as work:
    records = work.read(work.input.records, "direction_records")
    words = work.read(work.input.events, "direction_events").query("tier == 'word'")
    coefficients = dict(iter(work.read(work.input.mfcc, "mfcc").groupby("clip", sort=False)))
    frames = {name: keywords.normalised(table[mfcc.COLUMNS].to_numpy()) for name, table in coefficients.items()}
    settings, training = keywords.Settings(**work.params["keywords"]), Training(**work.params["training"])
    portion_of = dict(zip(records["record"], records["portion"], strict=True))
    found = []
    for portion, trained in (("validation", ["training"]), ("test", ["training", "validation"])):
        own = {name: values for name, values in frames.items() if portion_of[name] in trained}
        asked = {name: values for name, values in frames.items() if portion_of[name] == portion}
        for gaussians in settings.gaussians:
            network = keywords.spotter(own, words, settings, gaussians, training, work.params["seed"])
            spotted = keywords.spots(network, asked)
            found.append(
                spotted.assign(
                    task="keywords", method="word HMMs", setting=np.int64(gaussians), portion=portion, actual=None
                )
            )
    work.write(found, work.output.detections, "direction_detections")
