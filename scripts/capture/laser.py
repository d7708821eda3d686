"""The laser spot in every view of the calibration take."""

import pandas as pd

from cospeech import job
from cospeech.capture import footage, laser

with job.run(snakemake) as work:
    views = []
    for name, path in zip(work.params["views"], work.input.films, strict=True):
        film = footage.examine(path)
        pictures = (pictures[0] for pictures in footage.read([film], film.n_frames))
        views.append(laser.sightings(name, pictures, film.size_px[0]))
        work.say(f"{name}: the spot in {len(views[-1])} of {film.n_frames} frames")
    work.write(pd.concat(views, ignore_index=True), work.output.laser, "laser")
