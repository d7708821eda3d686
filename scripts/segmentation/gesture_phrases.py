"""Segment one record with its actor's gesture model; evaluation uses the result as the actual phrases."""

from cospeech.segmentation import gesture, labelled_hmm
from cospeech.workflow import job

with job.run(snakemake) as work:
    segments = gesture.phrases(
        labelled_hmm.from_table(work.read(work.input.model, "hmm_model")),
        work.wildcards.record,
        work.read(work.input.motion, "motion"),
        work.read(work.input.annotations, "annotations"),
    )
    work.write(segments, work.output.segments, "segments")
