"""The record sheet of the run: one row a record."""

import pandas as pd

from cospeech import job

with job.run(snakemake) as work:
    rows = [work.read(path, "records") for path in work.input.records]
    work.write(pd.concat(rows, ignore_index=True), work.output.records, "records")
