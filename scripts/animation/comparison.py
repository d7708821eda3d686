"""Video of one record three times: original, synthesised and random side by side, with its sound."""

from cospeech import job, tables
from cospeech.animation import video

with job.run(snakemake) as work:
    panels = [
        video.Panel(title, work.read(motion, "motion"), work.read(phrases, "segments"))
        for title, motion, phrases in zip(work.params["titles"], work.input.motions, work.input.phrases, strict=True)
    ]
    caption = f"{work.wildcards.record} · {work.corpus}"
    with tables.replacing(work.output.video) as path:
        video.film(path, panels, caption, sound=work.input.get("audio"), **work.params["settings"])
