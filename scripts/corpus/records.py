"""Collect the record table of the run, one row per record."""

from cospeech.workflow import job

with job.run(snakemake) as work:
    rows = [work.read(path, "records") for path in work.input.records]
    work.write(rows, work.output.records, "records")
