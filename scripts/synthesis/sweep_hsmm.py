"""The HSMM of one fold at each setting of the prosody clusters: its tables, and its phrases, printed and weighted."""

import pandas as pd

from cospeech import job
from cospeech.markov import semi
from cospeech.synthesis import hsmm, hsmm_weighted
from cospeech.synthesis.fold import fold
from cospeech.synthesis.speech import frame_labels, heard

with job.run(snakemake) as work:
    record, frame_s, censoring = work.wildcards.record, work.params["frame_s"], work.params["censoring"]
    gestures = pd.concat([work.read(path, "segments") for path in work.input.gestures])
    for place, clusters in enumerate(work.followed(work.params["clusters"], "settings")):
        prosody = work.read(work.input.prosody[place], "segments")
        paths = work.output.tables[place * len(semi.TABLES) : (place + 1) * len(semi.TABLES)]
        how = hsmm.Estimate(clusters=clusters, **work.params["estimate"])
        known = fold(record, gestures, prosody, frame_s)
        counts = hsmm.counts(known, how)
        model = hsmm.train(counts.values(), how)
        for (name, table), path in zip(semi.to_tables(model, frame_s, how.floor).items(), paths, strict=True):
            work.write(table, path, name)
        speech = heard(frame_labels(prosody), record, frame_s)
        printed = hsmm.synthesise(model, speech, censoring=censoring)
        work.write(printed.phrases, work.output.phrases[place], "segments")
        work.write(printed.decoding, work.output.decoding[place], "decoding")
        weight = hsmm_weighted.choose_weight(known, counts, how, work.params["weights"], censoring)
        work.say(f"{clusters} clusters: emission weight {weight:g}")
        weighted = hsmm.synthesise(model, speech, weight, censoring)
        work.write(weighted.phrases, work.output.weighted_phrases[place], "segments")
        work.write(weighted.decoding, work.output.weighted_decoding[place], "decoding")
