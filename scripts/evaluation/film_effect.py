"""Scores from filmed joint angles beside those from the true ones."""

import pandas as pd

from cospeech import job
from cospeech.evaluation import film_effect, sessions

with job.run(snakemake) as work:
    bootstrap = sessions.Bootstrap(**work.params["bootstrap"], seed=work.params["seed"])
    true = pd.concat([work.read(path, "record_scores") for path in work.input.true], ignore_index=True)
    filmed = work.read(work.input.filmed, "record_scores")
    work.write(film_effect.film_effect(filmed, true, bootstrap), work.output.effect, "film_effect")
