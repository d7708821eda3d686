"""Draw a head for each of its patterns, at the state that is farthest from rest."""

from cospeech.formats import canvas
from cospeech.rendering import heads
from cospeech.workflow import job

with job.run(snakemake) as work:
    [path] = work.params["patterns"]
    canvas.save(heads.poses(*heads.farthest(work.read(path, "hmm_model"))), work.output.picture)
