"""Time what the 3D viewer and other programs need: python bench/viewer.py

Viewer data of 8 records of a minute with 5 versions each and their sound, and a binary glTF file of a minute. Where
Chromium is installed, also the opening of such a page with one record, and the frames per second with four bodies, by
its software renderer.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from cospeech.formats import glb_writer, sound
from cospeech.geometry import rotation
from cospeech.motion.body import STANDARD
from cospeech.motion.library import Poses
from cospeech.rendering import export
from cospeech.speech import pitch
from cospeech.viewer import page, takes, voice

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "viewer"))

MINUTE_S, FPS, N_RECORDS, N_VERSIONS = 60, 20.0, 8, 5
PACKING_S, GLB_S, OPENING_S, FRAMES_PER_S = 5.0, 0.3, 2.0, 20.0
"""The goals."""


def wander(seed: int) -> Poses:
    """Return a minute of random motion, each pose near the one before."""
    turns = np.cumsum(np.random.default_rng(seed).normal(0, 0.02, (int(MINUTE_S * FPS), len(STANDARD.joints), 3)), 0)
    return Poses(0.1 * turns[:, 0], rotation.to_quaternions(rotation.from_vectors(turns)))


def record(versions: list[takes.Version]) -> takes.Take:
    """Return a record as the workflow shows it, whose pitch is known."""
    time_s = np.arange(MINUTE_S * sound.RATE_HZ) / sound.RATE_HZ
    f0_hz = np.full(round(MINUTE_S / pitch.STEP_S), 150.0)
    heard = voice.voice(0.2 * np.sin(2 * np.pi * (150 + 30 * np.sin(time_s)) * time_s), f0_hz)
    return takes.Take("record", versions, heard.encoded, heard.duration_s, heard.curves, voice.CURVE_S)


def told(what: str, value: float, unit: str, goal: float, more: bool = False) -> None:
    """Print a figure next to its goal."""
    reached = value >= goal if more else value <= goal
    print(f"{what}: {value:.2f} {unit}; goal {goal:g}, {'reached' if reached else 'MISSED'}")


def main() -> None:
    """Print the figures."""
    versions = [
        takes.Version(f"version {k}", takes.Articulated(STANDARD, wander(k)), FPS, skinned=True)
        for k in range(N_VERSIONS)
    ]
    begin = time.process_time()
    scripts = [page.take_script("record.js", record(versions)) for _ in range(N_RECORDS)]
    told(
        f"viewer data of {N_RECORDS} x {N_VERSIONS} minutes", time.process_time() - begin, "s of one core", PACKING_S
    )
    print(f"  {sum(map(len, scripts)) / 1e6:.1f} MB")
    with tempfile.TemporaryDirectory() as folder:
        surface, poses = export.surface(), wander(0)
        begin = time.perf_counter()
        glb_writer.write(Path(folder, "minute.glb"), "minute", STANDARD, poses, FPS, surface)
        told("GLB of a minute", time.perf_counter() - begin, "s", GLB_S)
        in_browser(Path(folder), record(versions))


def in_browser(folder: Path, shown: takes.Take) -> None:
    """Print how fast a page opens, and how fast four bodies move."""
    import browser

    if browser.CHROMIUM is None:
        print("no Chromium: the page was not opened")
        return
    path = folder / "page.html"
    path.write_text(page.page("bench", [shown]), encoding="utf-8")
    with browser.tab(folder / "profile") as tab:
        tab.size(1280, 900)
        begin = time.perf_counter()
        tab.open(path)
        tab.value("viewer.ready.then(() => new Promise(requestAnimationFrame))")
        told("page opened", time.perf_counter() - begin, "s", OPENING_S)
        tab.value("viewer.show(4, false); viewer.seek(1); viewer.setPlaying(true)")
        count = "const draw = viewer.drawFrame.bind(viewer); viewer.drawFrame = () => { n++; draw(); };"
        wait = "await new Promise(done => setTimeout(done, 5000)); return n / 5;"
        drawn = tab.value(f"(async () => {{ let n = 0; {count} {wait} }})()")
        told("frames with four bodies", drawn, "per second", FRAMES_PER_S, more=True)


if __name__ == "__main__":
    main()
