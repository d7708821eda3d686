"""The gesture phrases of one record, decoded with its actor's model: the actual phrases of all evaluation."""

from cospeech import job
from cospeech.phrases import gesture, model

with job.run(snakemake) as work:
    segments = gesture.phrases(
        model.from_table(work.read(work.input.model, "hmm_model")),
        work.wildcards.record,
        work.read(work.input.motion, "motion"),
        work.read(work.input.annotations, "annotations"),
    )
    work.write(segments, work.output.segments, "segments")
