"""Calibrate the cameras of the rig from a laser spot or a board, or read them from a camera file."""

import numpy as np

from cospeech.capture.calibration import (
    board,
    fingerprint,
    laser,
    quality,
    rig_picture,
    self_calibration,
    world_frame,
)
from cospeech.capture.tracking import footage
from cospeech.data import tables
from cospeech.formats import camera_toml
from cospeech.geometry import camera
from cospeech.workflow import job

with job.run(snakemake) as work:
    method, facts = work.params["method"], work.params["facts"]
    if method == "given":
        cameras, points_m = camera_toml.read(work.input.take[0], work.params["up"]), np.empty((0, 3))
        trust = quality.unknown(cameras)
    else:
        films = [footage.probe(path, colour=method == "laser") for path in work.input.take]
        names, sizes_px = [film.path.stem for film in films], [film.size_px for film in films]
        if method == "laser":
            observations, frames = laser.observations(work.read(work.input.laser, "laser"), names)
            found, points, used = self_calibration.calibrate(names, observations, sizes_px, work.params["seed"])
            change = world_frame.from_facts(found, facts, points, frames)
        else:
            declared = board.read(work.input.board)
            corners = board.observations(declared, work.read(work.input.corners, "corners"), names)
            found, points, used = board.calibrate(declared, names, corners, sizes_px)
            observations = corners.reshape(len(names), -1, 2)
            change = board.to_world(declared, found, points, facts)
        trust = quality.table(found, points, used, observations)
        cameras, points_m = change.cameras(found), change.points(points)
        for row in trust.itertuples():
            work.say(
                f"{row.camera}: reprojection error {row.rms_px:.3f} px over {row.n_points} points that cover "
                f"{row.coverage:.0%} of the image"
            )
    table = camera.to_table(cameras).merge(trust[["camera", "rms_px", "n_points"]], on="camera", validate="1:1")
    table["footage"] = table["camera"].map(fingerprint.of_take(list(table["camera"]), work.input.take))
    work.write(table, work.output.cameras, "cameras")
    work.write(trust, work.output.quality, "calibration_quality")
    with tables.replacing(work.output.picture) as path:
        rig_picture.save(rig_picture.draw(cameras, points_m), path)
