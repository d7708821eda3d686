"""Which joint angles the markers tell."""

from cospeech.report import capture, output
from cospeech.workflow import job

with job.run(snakemake) as work:
    tables = [work.read(path, "observability") for path in work.input.tables]
    output.save_table(capture.observed(tables), work.output.table)
