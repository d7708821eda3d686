"""The exhibits of the sweep, which need neither motion nor films."""

from cospeech.report.exhibits import drawing
from cospeech.workflow import job

with job.run(snakemake) as work:
    drawing.draw_all(work)
