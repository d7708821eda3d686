"""Render the heads of one record, as a video with sound and as a strip: film (if any), original, and synthesised."""

from cospeech.data import tables
from cospeech.formats import canvas
from cospeech.rendering import heads
from cospeech.workflow import job

with job.run(snakemake) as work:
    angles = [work.read(path, "head") for path in (work.input.original, *work.input.heads)]
    panels = [
        heads.Panel(title, table) for title, table in zip(work.params["titles"], angles, strict=True) if len(table)
    ]
    caption = f"{work.wildcards.record} · {work.corpus}"
    with tables.replacing(work.output.video) as path:
        heads.write_video(
            path,
            panels,
            caption,
            sound=work.input.audio or None,
            footage=work.input.film or None,
            **work.params["settings"],
        )
    canvas.save(heads.strip(panels, heads.liveliest(panels[0].angles)), work.output.strip)
