"""How often each gesture occurs, actual and synthesised."""

import pandas as pd

from cospeech.report import output, phrases, style
from cospeech.workflow import job

with job.run(snakemake) as work:
    given = work.params
    actual = [work.read(path, "segments") for path in work.input.actual]
    made = [work.read(path, "segments") for path in work.input.synthesised]
    sequences = {"actual": pd.concat(actual, ignore_index=True)} | phrases.by_system(made, given["systems"])
    table = phrases.frequencies(sequences, given["actors"], given["labels"])
    style.save(phrases.frequency_figure(table, given["titles"]), work.output.svg, work.output.png)
    output.save_table(table, work.output.table)
