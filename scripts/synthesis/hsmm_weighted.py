"""The phrases of one fold by the HSMM with an emission weight, at each setting of the prosody clusters."""

import pandas as pd

from cospeech import job
from cospeech.markov import semi
from cospeech.synthesis import hsmm, hsmm_weighted
from cospeech.synthesis.fold import fold
from cospeech.synthesis.speech import frame_labels, heard

with job.run(snakemake) as work:
    record, frame_s, censoring = work.wildcards.record, work.params["frame_s"], work.params["censoring"]
    gestures = pd.concat([work.read(path, "segments") for path in work.input.gestures])
    for place, clusters in enumerate(work.params["clusters"]):
        prosody = work.read(work.input.prosody[place], "segments")
        model = semi.from_tables({name: work.read(work.input.get(name)[place], name) for name in semi.TABLES})
        how = hsmm.Estimate(clusters=clusters, **work.params["estimate"])
        known = fold(record, gestures, prosody, frame_s)
        weight = hsmm_weighted.choose_weight(known, hsmm.counts(known, how), how, work.params["weights"], censoring)
        work.say(f"{clusters} clusters: emission weight {weight:g}")
        made = hsmm.synthesise(model, heard(frame_labels(prosody), record, frame_s), weight, censoring)
        work.write(made.phrases, work.output.phrases[place], "segments")
        work.write(made.decoding, work.output.decoding[place], "decoding")
