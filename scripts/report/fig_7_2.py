"""S and D against the number of prosody clusters, or of their states."""

from pathlib import Path

import yaml

from cospeech.report import output, style, sweep
from cospeech.workflow import job

with job.run(snakemake) as work:
    given = work.params
    published = yaml.safe_load(Path(work.input.published).read_text(encoding="utf-8"))
    scores = work.read(work.input.scores, "session_scores")
    main = {"clusters": given["clusters"], "states": given["states"]}
    swept = sweep.table(scores, given["axis"], main, given["systems"])
    best = sweep.best_published(published, given["axis"])
    figure = sweep.figure(swept, sweep.references(scores, **main), given["axis"], given["titles"], best)
    style.save(figure, work.output.svg, work.output.png)
    output.save_table(swept, work.output.table)
