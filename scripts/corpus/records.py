"""Collect the record table of the run, one row per record, with the notes on its annotations."""

from cospeech.corpus import annotations
from cospeech.workflow import job

with job.run(snakemake) as work:
    records = work.read(work.input.records, "records")
    work.write(
        annotations.add_notes(records, work.read(work.input.annotations, "annotations")),
        work.output.records,
        "records",
    )
