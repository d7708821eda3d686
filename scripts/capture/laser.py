"""The laser spot in every view of the calibration take."""

from cospeech.capture.calibration import laser
from cospeech.capture.tracking import footage
from cospeech.workflow import job

with job.run(snakemake) as work:
    films = [footage.examine(path) for path in work.input.films]
    footage.in_step(films, work.params["most_frames_apart"])
    views = []
    for film in films:
        pictures = (pictures[0] for pictures in footage.read([film], film.n_frames))
        views.append(laser.sightings(film.path.stem, pictures, film.size_px[0]))
        work.say(f"{film.path.stem}: the spot in {len(views[-1])} of {film.n_frames} frames")
    work.write(views, work.output.laser, "laser")
