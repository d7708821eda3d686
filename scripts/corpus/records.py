"""Collect the record table of the run, one row per record."""

from cospeech.corpus import short_records
from cospeech.workflow import job

with job.run(snakemake) as work:
    table = work.read(work.input.records, "records")
    noted = short_records.noted(table, work.params["shortest_s"], work.params["shift_s"])
    work.write(noted, work.output.records, "records")
