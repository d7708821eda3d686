"""Render the comparison video of one record: film (if any), original, synthesised and random motion, with sound.

Bodies whose motion consists of recorded gestures have the recorded head, too; here they get a synthesised one.
"""

from dataclasses import replace

from cospeech.data import tables
from cospeech.motion import head
from cospeech.rendering import video
from cospeech.workflow import job

with job.run(snakemake) as work:
    panels = [
        video.Panel(title, work.read(motion, "motion"), work.read(phrases, "segments"))
        for title, motion, phrases in zip(work.params["titles"], work.input.motions, work.input.phrases, strict=True)
    ]
    if work.input.head:
        angles = work.read(work.input.head, "head")
        panels = [
            replace(panel, motion=head.moved(panel.motion, angles)) if headless and len(panel.motion) else panel
            for panel, headless in zip(panels, work.params["headless"], strict=True)
        ]
    caption = f"{work.wildcards.record} · {work.corpus}"
    shown = [panel for panel in panels if not panel.motion.empty]  # not the systems that failed
    with tables.replacing(work.output.video) as path:
        sound, footage = work.input.get("audio"), work.input.get("shot") or None
        video.write_video(path, shown, caption, sound=sound, footage=footage, **work.params["settings"])
