"""What the equations of Sargin 2006, chapter 4, give as printed and as read, in one table."""

from cospeech.capture.head import readings
from cospeech.evaluation import head_readings
from cospeech.workflow import job

with job.run(snakemake) as work:
    planted = [reading._asdict() for reading in readings.readings(work.params["seed"])]
    if work.input.accuracy:
        planted += head_readings.flows(work.read(work.input.accuracy, "head_accuracy"))
    patterns, curves = (
        work.read(work.params[name], schema)
        for name, schema in (("patterns", "hmm_model"), ("curves", "head_curves"))
    )
    melody, original = work.read(work.input.melody, "melody"), work.read(work.input.head, "head")
    work.write(
        head_readings.table(
            [*planted, *head_readings.readings(patterns, melody, original), *head_readings.choices(curves)]
        ),
        work.output.table,
        "head_readings",
    )
