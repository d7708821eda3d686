"""Collect the annotations of all records in one table."""

from cospeech.workflow import job

with job.run(snakemake) as work:
    rows = [work.read(path, "annotations") for path in work.input.annotations]
    work.write(rows, work.output.annotations, "annotations")
