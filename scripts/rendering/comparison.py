"""Render the comparison video of one record: film (if any), original, synthesised and random motion, with sound.

Bodies whose motion consists of recorded gestures have the recorded head, too; here they get a synthesised one.
"""

from cospeech.data import tables
from cospeech.motion import head
from cospeech.rendering import video
from cospeech.workflow import job

with job.run(snakemake) as work:
    given = work.params
    angles = work.read(work.input.head, "head") if work.input.head else None
    motions = head.moved_where([work.read(path, "motion") for path in work.input.motions], given["headless"], angles)
    panels = [
        video.Panel(title, motion, work.read(phrases, "segments"))
        for title, motion, phrases in zip(given["titles"], motions, work.input.phrases, strict=True)
    ]
    caption = f"{work.wildcards.record} · {work.corpus}"
    shown = [panel for panel in panels if not panel.motion.empty]  # not the systems that failed
    with tables.replacing(work.output.video) as path:
        sound, footage = work.input.get("audio"), work.input.get("shot") or None
        video.write_video(path, shown, caption, sound=sound, footage=footage, **given["settings"])
