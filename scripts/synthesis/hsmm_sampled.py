"""The phrases of one fold drawn from the posterior of the HSMM."""

from cospeech import job
from cospeech.markov import semi
from cospeech.synthesis import hsmm_sampled
from cospeech.synthesis.speech import frame_labels, heard

with job.run(snakemake) as work:
    prosody = work.read(work.input.prosody, "segments")
    model = semi.from_tables({name: work.read(work.input.get(name), name) for name in semi.TABLES})
    weight = float(work.read(work.input.weighted, "decoding")["emission_weight"].iloc[0])
    speech = heard(frame_labels(prosody), work.wildcards.record, work.params["frame_s"])
    made = hsmm_sampled.synthesise(model, speech, weight, work.params["censoring"], work.params["seed"])
    work.write(made.phrases, work.output.phrases, "segments")
    work.write(made.decoding, work.output.decoding, "decoding")
