"""Speed, acceleration and jerk of original and synthesised motion, and how far they lie apart."""

from cospeech.evaluation import motion
from cospeech.workflow import job

with job.run(snakemake) as work:
    actors = work.params["actors"]
    keys = [(motion.ORIGINAL, record) for record in actors] + [tuple(key) for key in work.params["animated"]]
    paths = [*work.input.original, *work.input.synthesised]
    motions = {key: work.read(path, "motion") for key, path in zip(keys, paths, strict=True)}
    statistics, histograms = motion.statistics(motions, actors, work.params["bins"])
    work.write(statistics, work.output.statistics, "motion_statistics")
    work.write(histograms, work.output.histograms, "motion_histograms")
