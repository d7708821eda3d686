"""The gesture phrase classes, with their counts and durations."""

import pandas as pd

from cospeech import job
from cospeech.report import corpus, output

with job.run(snakemake) as work:
    phrases = pd.concat([work.read(path, "segments") for path in work.input.phrases], ignore_index=True)
    table = corpus.gesture_classes(phrases, work.params["actors"], work.params["labels"])
    output.save_table(table, work.output.table)
