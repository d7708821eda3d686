"""The phrases of one fold drawn from the HSMM, by all that hears wrong speech or none, and by another real record."""

import pandas as pd

from cospeech import job
from cospeech.markov import semi
from cospeech.synthesis import (
    another,
    clock,
    hsmm_sampled,
    majority,
    prior,
    random_phrases,
    systems,
    wrong_speech,
)
from cospeech.synthesis.fold import fold
from cospeech.synthesis.speech import frame_labels, heard

with job.run(snakemake) as work:
    record, frame_s, seed = work.wildcards.record, work.params["frame_s"], work.params["seed"]
    censoring, shift_s = work.params["censoring"], work.params["shift_s"]
    gestures = pd.concat([work.read(path, "segments") for path in work.input.gestures])
    prosody = work.read(work.input.prosody, "segments")
    labels = frame_labels(prosody)
    model = semi.from_tables({name: work.read(work.input.get(name), name) for name in semi.TABLES})
    weight = float(work.read(work.input.weighted, "decoding")["emission_weight"].iloc[0])
    known = fold(record, gestures, prosody, frame_s)
    own = heard(labels, record, frame_s)
    made = {
        "hsmm_sampled": hsmm_sampled.synthesise(model, own, weight, censoring, seed),
        "random": random_phrases.synthesise(known, seed),
        "prior": prior.synthesise(model, own, censoring),
        "clock": clock.synthesise(known),
        "majority": majority.synthesise(known),
        "another": another.synthesise(known, work.params["records"]),
    }
    known_systems = systems(studio=False)
    for place, name in enumerate(work.params["systems"]):
        if name not in made:
            control = known_systems[name]
            speech = heard(labels, record, frame_s, control.drive, seed, shift_s)
            made[name] = wrong_speech.synthesise(control, model, speech, weight, censoring, seed)
        work.write(made[name].phrases, work.output.phrases[place], "segments")
        work.write(made[name].decoding, work.output.decoding[place], "decoding")
