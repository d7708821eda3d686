"""Film the range-of-motion take of one actor from all cameras, and tell where every marker is."""

import numpy as np

from cospeech import job, tables
from cospeech.capture import camera
from cospeech.studio import dress, film, planted, range_of_motion, stage

with job.run(snakemake) as work:
    seed = work.params["seed"]
    fps = work.params["motion_fps"]
    motion = range_of_motion.perform(fps)
    cameras = camera.from_table(work.read(work.input.cameras, "cameras"))
    limbs, markers = stage.limbs(motion), dress.wear(motion, dress.places(work.wildcards.actor, seed))
    seen = np.empty((len(cameras), *markers.shape[:2]))
    for view, path, shown in zip(cameras, work.output.films, seen, strict=True):
        with tables.replacing(path) as temporary:
            film.encode(temporary, film.noted(film.frames(view, limbs, markers, seed), shown), fps)
    work.write(planted.in_views(cameras, markers, seen), work.output.markers_2d, "markers_2d")
    work.write(planted.in_world(markers, seen, fps), work.output.markers_3d, "markers_3d")
    work.write(motion, work.output.motion, "motion")
