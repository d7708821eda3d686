"""What capture found against what was planted, beside its goals."""

import pandas as pd

from cospeech.report import capture, output
from cospeech.workflow import job

with job.run(snakemake) as work:
    scores = work.read(work.input.scores, "capture_scores")
    table = capture.summary(scores, work.params["width_px"], work.params["method"])
    end = capture.experiment(work.read(work.input.effect, "film_effect"), work.params["bin_s"])
    output.save_table(pd.concat([table, end], ignore_index=True), work.output.table)
