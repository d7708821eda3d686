"""Compute the angles of the head relative to the chest, of all records that move a whole body."""

from cospeech.motion import head
from cospeech.workflow import job

with job.run(snakemake) as work:
    for motion, path in zip(work.input.motions, work.output.heads, strict=True):
        work.write(head.of_body(work.read(motion, "motion")), path, "head")
