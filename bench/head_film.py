"""Measure how fast the studio films a talking head: python bench/head_film.py

Draws and encodes a stereo film of 640 x 480 pixels on one core; the head turns, blinks and speaks.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np

from cospeech.data import segments
from cospeech.studio import face, film, stereo, take

FRAMES, GOAL_MS = 300, 12.0


def speaking(n_frames: int) -> face.Acting:
    """Return a head that turns about all axes, blinks and speaks."""
    times_s = segments.frame_times(n_frames, stereo.FPS)
    angles = np.column_stack([8.0 * np.sin(2.0 * times_s), 18.0 * np.sin(1.3 * times_s), 8.0 * np.sin(3.0 * times_s)])
    opening = np.abs(np.sin(9.0 * times_s))
    return face.Acting(angles, face.pivoted(angles), np.abs(np.sin(times_s)) ** 20, opening)


def main() -> None:
    """Print the processor time per stereo frame of drawing, and of drawing and encoding."""
    looks, pair, acting = face.appearance("ada", 2012), stereo.cameras(), speaking(FRAMES)
    take.shoot_head(speaking(3), looks, pair, [Path(tempfile.mkdtemp()) / f"{k}.mkv" for k in (1, 2)], stereo.FPS, 1)
    start = time.process_time()
    for _ in face.frames(acting, looks, pair):
        pass
    drawn_ms = (time.process_time() - start) / FRAMES * 1e3
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{camera.name}.mkv" for camera in pair]
        start = time.process_time()
        take.shoot_head(acting, looks, pair, paths, stereo.FPS, 1)
        filmed_ms = (time.process_time() - start) / FRAMES * 1e3
        size_kb = sum(path.stat().st_size for path in paths) / FRAMES / 1e3
        n_decoded = sum(1 for _ in film.decode(paths[0]))
    print(f"drawing {drawn_ms:.1f} ms, drawing and encoding {filmed_ms:.1f} ms per stereo frame; goal {GOAL_MS:g} ms")
    print(f"{size_kb:.0f} kB per stereo frame; {n_decoded} frames")


if __name__ == "__main__":
    main()
