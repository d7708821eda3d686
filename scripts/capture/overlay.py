"""The films of one record side by side, with the markers drawn on them."""

from cospeech import job, mp4, tables, trajectories
from cospeech.capture import camera, overlay

with job.run(snakemake) as work:
    cameras = camera.from_table(work.read(work.input.cameras, "cameras"))
    views, world = work.read(work.input.views, "markers_2d"), work.read(work.input.world, "markers_3d")
    fps, title = trajectories.frame_rate(world), f"{work.wildcards.record} · {work.corpus}"
    with tables.replacing(work.output.video) as path:
        mp4.encode(path, overlay.mosaic(work.input.films, cameras, views, fps, title), fps)
