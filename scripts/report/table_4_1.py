"""The gesture phrase classes, with their counts and durations."""

from cospeech.report import corpus, output
from cospeech.workflow import job

with job.run(snakemake) as work:
    phrases = work.read(work.input.phrases, "segments")
    table = corpus.gesture_classes(phrases, work.params["actors"], work.params["labels"])
    output.save_table(table, work.output.table)
