"""Annotated examples of one record: read from a file, planted by the studio, or none."""

from cospeech.corpus import annotations
from cospeech.workflow import job

with job.run(snakemake) as work:
    row = work.read(work.input.record, "records").iloc[0]
    name, duration_s, labels = row["record"], float(row["duration_s"]), work.params["labels"]
    if work.input.get("annotations"):
        recording = annotations.Recording(name, duration_s, **work.params["recording"])
        examples = annotations.read(work.input.annotations, recording, labels, work.params["tier"])
        for note in examples["note"].unique() if "note" in examples else ():
            work.say(f"{name}: {note}")
    else:
        planted = work.read(work.input.planted, "annotations") if work.input.get("planted") else None
        examples = annotations.select_record(planted, name, duration_s, labels)
    work.write(examples, work.output.annotations, "annotations")
