"""Render the films of one record side by side, overlaid with the tracked markers."""

from cospeech.capture.tracking import footage, overlay
from cospeech.data import tables, trajectories
from cospeech.formats import mp4
from cospeech.geometry import camera
from cospeech.workflow import job

with job.run(snakemake) as work:
    began = work.read(work.input.offsets, "offsets") if work.input.get("offsets") else None
    rig = camera.from_table(work.read(work.input.cameras, "cameras"))
    films, cameras = footage.open_take(work.input.films, began, rig)
    views, world = work.read(work.input.views, "markers_2d"), work.read(work.input.world, "markers_3d")
    fps, title = trajectories.frame_rate(world), f"{work.wildcards.record} · {work.corpus}"
    with tables.replacing(work.output.video) as path:
        mp4.encode(path, overlay.mosaic(films, cameras, views, fps, title), fps)
