"""Measure the speed and memory of rendering and tracking video: python bench/capture.py

The range-of-motion take is drawn, encoded, decoded and tracked on one thread, at full and at half size. Decoding with
and without tracking take turns, and the best of three passes counts; for drawing it is the best of 40 frames, because
other work on the machine disturbs single ones.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pandas as pd

from cospeech.capture.tracking import detections, footage, track
from cospeech.geometry.camera import Camera
from cospeech.studio import dress, film, range_of_motion, rig, stage

SEED, ACTOR = 1, "ada"
GOAL = 0.75
LENGTHS_S = (10, 60)


def scene(n_frames: int) -> tuple[np.ndarray, np.ndarray]:
    """Return limbs and markers of ``n_frames`` frames: the part of the take in which arms move, repeated."""
    motion = range_of_motion.perform(rig.FPS)
    motion = pd.concat([motion] * (n_frames // len(motion) + 1), ignore_index=True)[:n_frames]
    return stage.limbs(motion), dress.wear(motion, dress.places(ACTOR, SEED))


def timed(work: Callable[[], object]) -> float:
    """Return the seconds that ``work`` takes."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def exhaust(pictures: Iterable[object]) -> None:
    """Consume all frames."""
    for _ in pictures:
        pass


def shoot(folder: Path, cameras: list[Camera], n_frames: int) -> list[footage.Film]:
    """Write the videos of the take to ``folder`` and return their paths."""
    limbs, markers = scene(n_frames)
    for camera in cameras:
        shots = film.frames(camera, limbs, markers, SEED)
        film.encode(folder / f"{camera.name}.mkv", (planes for planes, _ in shots), rig.FPS)
    return [footage.probe(folder / f"{camera.name}.mkv") for camera in cameras]


def speed(folder: Path, width_px: int, n_frames: int) -> bool:
    """Print the speeds at one size, and return whether tracking reaches its goal."""
    cameras = rig.cameras(width_px, SEED)
    limbs, markers = scene(n_frames)
    films = shoot(folder, cameras, 4)
    track.track_markers(films, cameras, "robust", 4, where="bench")  # compile
    pictures = [planes.copy() for planes, _ in film.frames(cameras[2], limbs[:40], markers[:40], SEED)]
    encoding = min(timed(lambda: film.encode(folder / "c.mkv", pictures, rig.FPS)) for _ in range(3)) / len(pictures)
    shots = film.frames(cameras[2], limbs, markers, SEED)
    drawing = min(timed(lambda: next(shots)) for _ in range(40))
    films = shoot(folder, cameras, n_frames)
    passes = [
        (
            timed(lambda: exhaust(footage.read(films, n_frames))),
            timed(lambda: track.track_markers(films, cameras, "robust", n_frames, where="bench")),
        )
        for _ in range(3)
    ]
    decoding, tracking = np.min(passes, axis=0)
    print(
        f"{width_px:>5} x {cameras[0].size_px[1]:<5} {1e3 * drawing:>8.2f} {1e3 * encoding:>10.2f} "
        f"{n_frames / decoding:>12.1f} {n_frames / tracking:>16.1f} {decoding / tracking:>10.0%}"
    )
    return bool(decoding / tracking >= GOAL)


def memory(seconds: int) -> None:
    """Print the peak memory of this process in MB after rendering, and after tracking."""
    cameras, n_frames = rig.cameras(rig.FULL_PX[0] // 2, SEED), round(seconds * rig.FPS)
    with tempfile.TemporaryDirectory() as folder:
        films = shoot(Path(folder), cameras, n_frames)
        filming = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        found = track.track_markers(films, cameras, "robust", n_frames, where="bench")
        world = detections.world_table(found, rig.FPS, 0.5)
        detections.view_table(found, world, cameras)
        tracking = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(f"{seconds:>8} {filming / 1024:>14.0f} {tracking / 1024:>14.0f}")


def main() -> None:
    """Print a table of speeds and one of memory."""
    print(
        "  picture        draw ms  encode ms  decode set/s  with tracking/s  ratio  (five films; draw, encode: one)"
    )
    reached = []
    for width_px, n_frames in ((rig.FULL_PX[0], 100), (rig.FULL_PX[0] // 2, 200)):
        with tempfile.TemporaryDirectory() as folder:
            reached.append(speed(Path(folder), width_px, n_frames))
    print(f"goal of {GOAL:.0%} at full size " + ("reached" if reached[0] else "MISSED"))
    print("  film s   peak MB filming, and tracking after it (half size)", flush=True)
    for seconds in LENGTHS_S:
        subprocess.run([sys.executable, __file__, str(seconds)], check=True)


if __name__ == "__main__":
    memory(int(sys.argv[1])) if len(sys.argv) > 1 else main()
