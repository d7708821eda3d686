"""What capture found against what was planted, beside its goals."""

from cospeech import job
from cospeech.report import capture, output

with job.run(snakemake) as work:
    scores = work.read(work.input.scores, "capture_scores")
    table = capture.summary(scores, work.params["width_px"], work.params["method"])
    output.save_table(table, work.output.table)
