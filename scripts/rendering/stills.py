"""Draw a typical frame of each gesture class from the corpus."""

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
    table = stills.typical_frames(phrases, motions, work.params["labels"])
    work.write(table, work.output.table, "stills")
    footage = dict(zip(work.params["records"], map(Path, work.input.shots), strict=False))
    canvas.save(stills.grid(table, motions, footage), work.output.picture)
