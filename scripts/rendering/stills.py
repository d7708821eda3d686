"""A typical picture of each gesture class, from real frames of the corpus."""

from pathlib import Path

from cospeech.formats import canvas
from cospeech.rendering import stills
from cospeech.workflow import job

with job.run(snakemake) as work:
    phrases = work.read(work.input.phrases, "segments")
    motions = {
        record: work.read(path, "motion")
        for record, path in zip(work.params["records"], work.input.motions, strict=True)
    }
    table = stills.typical(phrases, motions, work.params["labels"])
    work.write(table, work.output.table, "stills")
    shots = dict(zip(work.params["records"], map(Path, work.input.shots), strict=False))
    canvas.save(stills.grid(table, motions, shots), work.output.picture)
