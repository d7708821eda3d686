"""Which joint angles the markers tell."""

from cospeech import job
from cospeech.report import capture, output

with job.run(snakemake) as work:
    tables = [work.read(path, "observability") for path in work.input.tables]
    output.save_table(capture.observed(tables), work.output.table)
