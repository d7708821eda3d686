"""Frames of a synthesised animation."""

from cospeech import job
from cospeech.report import pictures, style

with job.run(snakemake) as work:
    style.save(pictures.figure(work.input.picture), work.output.svg, work.output.png)
