"""The exhibits of the run, apart from those that show nothing but scores."""

from cospeech.report.exhibits import drawing
from cospeech.workflow import job

with job.run(snakemake) as work:
    drawing.draw_all(work)
