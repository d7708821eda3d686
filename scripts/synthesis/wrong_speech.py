"""The phrases of one fold by every decoder of the HSMM under wrong speech."""

from cospeech import job
from cospeech.markov import semi
from cospeech.synthesis import systems, wrong_speech
from cospeech.synthesis.speech import frame_labels, heard

with job.run(snakemake) as work:
    record, seed = work.wildcards.record, work.params["seed"]
    labels = frame_labels(work.read(work.input.prosody, "segments"))
    model = semi.from_tables({name: work.read(work.input.get(name), name) for name in semi.TABLES})
    weight = float(work.read(work.input.weighted, "decoding")["emission_weight"].iloc[0])
    known = systems(studio=False)
    for place, name in enumerate(work.params["systems"]):
        speech = heard(labels, record, work.params["frame_s"], known[name].drive, seed, work.params["shift_s"])
        made = wrong_speech.synthesise(known[name], model, speech, weight, work.params["censoring"], seed)
        work.write(made.phrases, work.output.phrases[place], "segments")
        work.write(made.decoding, work.output.decoding[place], "decoding")
