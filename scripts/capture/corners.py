"""Detect the corners of the board in every view of the calibration take."""

from cospeech.capture.calibration import board
from cospeech.capture.tracking import footage
from cospeech.workflow import job

with job.run(snakemake) as work:
    declared = board.read(work.input.board)
    films = [footage.probe(path, colour=False) for path in work.input.films]
    footage.common_length(films, work.params["most_frames_apart"])
    views = []
    for film in films:
        views.append(board.detections(declared, film.path.stem, footage.brightness(film)))
        work.say(f"{film.path.stem}: board detected in {views[-1]['frame'].nunique()} of {film.n_frames} frames")
    work.write(views, work.output.corners, "corners")
