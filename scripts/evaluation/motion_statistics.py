"""Speed, acceleration and jerk of original and synthesised motion, how far they lie apart, and faults of the motion.

One job for all of it, because most of its time is spent on reading the motion.
"""

from cospeech.evaluation import motion, motion_quality
from cospeech.motion import assembly
from cospeech.workflow import job

with job.run(snakemake) as work:
    actors = work.params["actors"]
    keys = [(motion.ORIGINAL, record) for record in actors] + [tuple(key) for key in work.params["animated"]]
    paths = [*work.input.original, *work.input.synthesised]
    motions = {key: work.read(path, "motion") for key, path in zip(keys, paths, strict=True)}
    statistics, histograms = motion.statistics(motions, actors, work.params["bins"])
    work.write(statistics, work.output.statistics, "motion_statistics")
    work.write(histograms, work.output.histograms, "motion_histograms")
    units = zip(work.params["assembled"], work.input.units, strict=True)
    joins = {tuple(key): assembly.boundaries(work.read(path, "units")) for key, path in units}
    for key, path in zip(work.params["decided"], work.params["decisions"], strict=True):
        joins[tuple(key)] = motion_quality.joins_between(work.read(path, "subunit_decisions")["frame"])
    work.write(motion_quality.table(motions, joins, actors), work.output.quality, "motion_quality")
