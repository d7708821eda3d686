"""The corpus by scenario."""

from cospeech import job
from cospeech.report import corpus, output

with job.run(snakemake) as work:
    output.save_table(corpus.scenarios(work.read(work.input.records, "records")), work.output.table)
