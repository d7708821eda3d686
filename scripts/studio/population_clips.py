"""Collect the clips of all speakers of a population in one table, and their phones in another."""

from cospeech.workflow import job

with job.run(snakemake) as work:
    work.write(work.read(work.input.clips, "clips"), work.output.clips, "clips")
    work.write(work.read(work.input.phones, "phones"), work.output.phones, "phones")
