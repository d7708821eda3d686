"""Detect the laser spot in every view of the calibration take."""

from cospeech.capture.calibration import laser
from cospeech.capture.tracking import footage
from cospeech.workflow import job

with job.run(snakemake) as work:
    films = [footage.probe(path) for path in work.input.films]
    footage.common_length(films, work.params["most_frames_apart"])
    views = []
    for film in films:
        pictures = (pictures[0] for pictures in footage.read([film], film.n_frames))
        views.append(laser.detections(film.path.stem, pictures, film.size_px[0]))
        work.say(f"{film.path.stem}: spot detected in {len(views[-1])} of {film.n_frames} frames")
    work.write(views, work.output.laser, "laser")
