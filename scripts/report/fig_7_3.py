"""Duration histograms of one actor, synthesised above actual."""

import pandas as pd

from cospeech.report import output, phrases, style
from cospeech.workflow import job

with job.run(snakemake) as work:
    given = work.params
    actual = [work.read(path, "segments") for path in work.input.actual]
    made = [work.read(path, "segments") for path in work.input.synthesised]
    synthesised = phrases.by_system(made, given["systems"])
    table = phrases.durations(
        pd.concat(actual, ignore_index=True),
        synthesised,
        given["labels"],
        given["bin_s"],
        given["max_duration_s"],
    )
    style.save(phrases.duration_figure(table, given["titles"]), work.output.svg, work.output.png)
    output.save_table(table, work.output.table)
