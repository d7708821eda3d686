"""A record's voice, through the model of another actor's head."""

from cospeech import api
from cospeech.workflow import job

with job.run(snakemake) as work:
    model = api.load_head_model(work.input.model)
    made = api.synthesize_head(work.input.audio, model, record=work.wildcards.record, seed=work.params["seed"])
    work.write(made.head, work.output.head, "head")
