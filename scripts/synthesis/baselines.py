"""The phrases of one fold by everything that hears no speech: random, prior, clock, majority and another."""

import pandas as pd

from cospeech import job
from cospeech.markov import semi
from cospeech.synthesis import another, clock, majority, prior, random_phrases
from cospeech.synthesis.fold import fold
from cospeech.synthesis.speech import frame_labels, heard

with job.run(snakemake) as work:
    record, frame_s = work.wildcards.record, work.params["frame_s"]
    gestures = pd.concat([work.read(path, "segments") for path in work.input.gestures])
    prosody = work.read(work.input.prosody, "segments")
    model = semi.from_tables({name: work.read(work.input.get(name), name) for name in semi.TABLES})
    known = fold(record, gestures, prosody, frame_s)
    made = {
        "random": random_phrases.synthesise(known, work.params["seed"]),
        "prior": prior.synthesise(model, heard(frame_labels(prosody), record, frame_s), work.params["censoring"]),
        "clock": clock.synthesise(known),
        "majority": majority.synthesise(known),
        "another": another.synthesise(known, work.params["records"]),
    }
    for place, system in enumerate(work.params["systems"]):
        work.write(made[system].phrases, work.output.phrases[place], "segments")
        work.write(made[system].decoding, work.output.decoding[place], "decoding")
