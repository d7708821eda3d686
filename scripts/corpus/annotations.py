"""The labelled examples of all records in one table."""

import pandas as pd

from cospeech import job

with job.run(snakemake) as work:
    rows = [work.read(path, "annotations") for path in work.input.annotations]
    work.write(pd.concat(rows, ignore_index=True), work.output.annotations, "annotations")
