"""Successive frames of a synthesised animation, one row an actor."""

from cospeech import job
from cospeech.animation import picture, stills

with job.run(snakemake) as work:
    motions = [work.read(path, "motion") for path in work.input.motions]
    phrases = [work.read(path, "segments") for path in work.input.phrases]
    captions = [f"{work.params['system']} · {record} · {work.corpus}" for record in work.params["records"]]
    picture.save(stills.strip(motions, phrases, captions), work.output.picture)
