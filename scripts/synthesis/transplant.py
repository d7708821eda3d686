"""A record's speech, through the model of another actor."""

from cospeech import api
from cospeech.formats import bvh
from cospeech.workflow import job

with job.run(snakemake) as work:
    model = api.load_model(work.input.model)
    own = work.read(work.input.own, "motion")
    made = api.synthesize(work.input.audio, model, record=work.wildcards.record, seed=work.params["seed"], body=own)
    work.write(made.phrases, work.output.phrases, "segments")
    work.write(made.motion, work.output.motion, "motion")
    bvh.write(made.motion, work.output.bvh)
