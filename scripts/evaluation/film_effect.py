"""Scores from filmed joint angles, compared with those from the true ones."""

from cospeech.evaluation import film_effect, sessions
from cospeech.workflow import job

with job.run(snakemake) as work:
    bootstrap = sessions.Bootstrap(**work.params["bootstrap"], seed=work.params["seed"])
    true = work.read(work.input.true, "record_scores")
    filmed = work.read(work.input.filmed, "record_scores")
    work.write(film_effect.film_effect(filmed, true, bootstrap), work.output.effect, "film_effect")
