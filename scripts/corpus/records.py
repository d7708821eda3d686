"""Collect the record table of the run, one row per record, with the notes on annotations and on missing controls."""

from cospeech.corpus import annotations, short_records
from cospeech.workflow import job

with job.run(snakemake) as work:
    table = work.read(work.input.records, "records")
    if work.input.annotations:
        table = annotations.add_notes(table, work.read(work.input.annotations, "annotations"))
    noted = short_records.noted(table, work.params["shortest_s"], work.params["shift_s"])
    work.write(noted, work.output.records, "records")
