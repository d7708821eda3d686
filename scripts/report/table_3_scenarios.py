"""The corpus by scenario."""

from cospeech.report import corpus, output
from cospeech.workflow import job

with job.run(snakemake) as work:
    output.save_table(corpus.scenarios(work.read(work.input.records, "records")), work.output.table)
