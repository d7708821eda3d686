"""Render the video of one synthesised record: the body from two sides, with the sound of the record."""

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.rendering import video
from cospeech.workflow import job

with job.run(snakemake) as work:
    panel = video.Panel(
        work.wildcards.system, work.read(work.input.motion, "motion"), work.read(work.input.phrases, "segments")
    )
    if panel.motion.empty:
        raise UserError(f"{panel.title} failed for record {work.wildcards.record}, so that there is nothing to show")
    caption = f"{work.wildcards.record} · {work.corpus}"
    with tables.replacing(work.output.video) as path:
        video.write_video(path, [panel], caption, sound=work.input.get("audio"), **work.params["settings"])
