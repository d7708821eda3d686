"""Film the calibration take from all cameras, and save the true positions of the laser spot."""

from cospeech.data import tables
from cospeech.geometry import camera
from cospeech.studio import film, laser, rig
from cospeech.workflow import job

with job.run(snakemake) as work:
    seed = work.params["seed"]
    cameras = camera.from_table(work.read(work.input.cameras, "cameras"))
    seen = laser.visible_spots(cameras, laser.walk(laser.N_FRAMES, seed), seed)
    for view, path in zip(cameras, work.output.films, strict=True):
        rows = seen[seen["camera"] == view.name]
        with tables.replacing(path) as temporary:
            film.encode(temporary, laser.frames(view, rows, laser.N_FRAMES, seed), rig.FPS)
    work.write(seen, work.output.laser, "laser")
