"""Draw successive frames of a synthesised animation, one row per actor."""

from cospeech.formats import canvas
from cospeech.rendering import stills
from cospeech.workflow import job

with job.run(snakemake) as work:
    motions = [work.read(path, "motion") for path in work.input.motions]
    phrases = [work.read(path, "segments") for path in work.input.phrases]
    captions = [f"{work.params['system']} · {record} · {work.corpus}" for record in work.params["records"]]
    canvas.save(stills.strip(motions, phrases, captions), work.output.picture)
