"""Time body language: python bench/bodylanguage.py

A made-up actor moves head, arms and legs between random poses, and speaks random syllables, about seven per second.

- *Update*: one syllable observation in one body section: forward and direct probabilities, their product, and the
  choice of a subunit. The exact distribution of the elapsed share is compared with its expectation in the same run.
  Goal: 8 to 11 us.
- *Live*: the processor time of one hop of 25 ms, garbage collection included, over ten minutes of speech, with motion
  at 20 and at 60 frames per second. *Best of five* takes the best of five passes of each hop: what remains when
  neither other programs nor garbage collection disturb. Goal: 60 us at the 99th percentile.
- *Memory*: what a state has allocated after one and after ten minutes of speech.
"""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.kernels.jit import njit
from cospeech.motion import skeleton
from cospeech.segmentation import subunits
from cospeech.synthesis import live
from cospeech.synthesis.bodylanguage import model, player_kernels, proposed
from cospeech.synthesis.interface import Speech, Training
from cospeech.synthesis.live import Stream

MINUTES = {3.0: 8, 12.0: 24}
"""Minutes of training motion, and the mean number of subunits per cluster."""
FPS, FRAME_S, SPEECH_S, UPDATES = 20.0, 0.025, 600.0, 20_000
SEGMENTATION = {
    "threshold": 0.4,
    "minimum_s": 0.2,
    "longest_s": 2.0,
    "weights": {"length": 0.5, "pose": 0.5, "still_pose": 2.0},
}


def motion(duration_s: float, rng: np.random.Generator) -> pd.DataFrame:
    """Return a body whose sections move smoothly between random poses, each at its own times."""
    n_frames = round(duration_s * FPS)
    angles = np.zeros((n_frames, len(skeleton.JOINTS), 3))
    reach = {"head": 8.0, "arms": 25.0, "legs": 3.0}
    for section, joints in skeleton.SECTIONS.items():
        own = [skeleton.JOINTS.index(joint) for joint in joints]
        frame, pose = 0, np.zeros((len(own), 3))
        while frame < n_frames:
            hold, move = (round(FPS * seconds) for seconds in (rng.uniform(0.2, 1.5), rng.uniform(0.3, 1.0)))
            target = reach[section] * rng.normal(size=pose.shape)
            share = np.concatenate([np.zeros(hold), np.linspace(0.0, 1.0, move)])
            share = (share**3 * (10 - 15 * share + 6 * share**2))[: n_frames - frame]
            angles[frame : frame + len(share), own] = pose + share[:, None, None] * (target - pose)
            frame, pose = frame + hold + move, target
    return skeleton.motion_table(np.zeros((n_frames, 3)), angles, FPS)


def syllables(duration_s: float, rng: np.random.Generator) -> pd.DataFrame:
    """Return random syllables, some of them unvoiced, with pauses between some."""
    n = round(duration_s / 0.05)
    lengths = rng.uniform(0.06, 0.2, n)
    starts = 0.3 + np.cumsum(np.where(rng.random(n) < 0.1, rng.uniform(0.1, 1.5, n), 0.0) + np.roll(lengths, 1))
    voiced = np.where(rng.random(n) < 0.7, 1.0, np.nan)
    table = pd.DataFrame({"record": "one", "syllable": np.arange(n), "start_s": starts})
    table["peak_s"], table["end_s"] = starts + 0.5 * lengths, starts + lengths
    table["known_s"] = np.maximum.accumulate(table["peak_s"] + rng.uniform(0.1, 0.2, n))
    for name in ("f0_hz", "f0_rise_hz", "f0_fall_hz"):
        table[name] = voiced * rng.uniform(0.0, 40.0, n)
    table["intensity_db"] = rng.normal(-25.0, 6.0, n)
    return table[table["known_s"] < duration_s].reset_index(drop=True)


def trained(minutes: float, members: int, mode: str, rng: np.random.Generator) -> model.Model:
    """Return a model of so many minutes of motion, in records of three minutes."""
    records = [f"r{k}" for k in range(max(2, round(minutes / 3)))]
    seconds = 60.0 * minutes / len(records)
    motions = {record: motion(seconds, rng) for record in records}
    per_cluster = {"members_per_cluster": dict.fromkeys(skeleton.SECTIONS, members)}
    found = subunits.find(motions, SEGMENTATION | per_cluster)
    own = {
        record: {section: table[table["record"] == record] for section, table in found.items()} for record in records
    }
    spoken = {record: syllables(seconds, rng) for record in records}
    training = Training("a", FRAME_S, (), (), {}, {}, motions=motions, syllables=spoken, subunits=own)
    return model.train(training, {"elapsed": mode, "pose_tolerance_deg": 5.0, "blending": "velocity"})


@njit
def updates(known: Any, used: Any, frame: Any, pose: Any, observations: Any, desired: Any) -> None:
    """Make the decisions of observations, one call for each as in live use."""
    for k in range(len(observations)):
        used[0] = 0
        frame[:] += 3
        player_kernels.advance(*known, pose, observations[k : k + 1], 0.14, False, desired)


def best_us(function: Callable[[], None], n: int, times: int = 5) -> float:
    """Return the processor time per step of the fastest of several calls, which make ``n`` steps each, in us."""
    found = []
    for _ in range(times):
        begin = time.thread_time_ns()
        function()
        found.append((time.thread_time_ns() - begin) / n / 1000)
    return min(found)


def hop_times(learnt: model.Model, heard: list[live.Heard], fps: float, passes: int) -> Floats:
    """Return the processor time of each hop in us, (passes, hops)."""
    times = np.empty((passes, len(heard)))
    for row in times:
        state = proposed.start(learnt, Stream("new", FRAME_S, fps), 0)
        for place, one in enumerate(heard):
            begin = time.thread_time_ns()
            proposed.step(state, one)
            row[place] = (time.thread_time_ns() - begin) / 1000
    return times


def held_kb(learnt: model.Model, heard: list[live.Heard]) -> float:
    """Return what a state has allocated after some speech, in kB."""
    state = proposed.start(learnt, Stream("new", FRAME_S, FPS), 0)
    tracemalloc.start()
    for one in heard:
        proposed.step(state, one)
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return held / 1000


def main() -> None:
    """Print the times for each length of training motion."""
    spoken = syllables(SPEECH_S, np.random.default_rng(1))
    heard = list(live.frames(Speech("new", FRAME_S, round(SPEECH_S / FRAME_S), syllables=spoken)))
    for minutes, members in MINUTES.items():
        models = {mode: trained(minutes, members, mode, np.random.default_rng(0)) for mode in ("exact", "expected")}
        clusters = ", ".join(f"{len(chain.initial)} of the {name}" for name, chain in models["exact"].chains.items())
        print(f"{minutes:g} minutes of motion; clusters: {clusters}")
        cost = {}
        for mode, learnt in models.items():
            state = proposed.start(learnt, Stream("new", FRAME_S, FPS), 0)
            observations = np.random.default_rng(2).choice([3, 4, 6, 12, 15], UPDATES)
            given = (
                state._known,
                state.memory.used,
                state.memory.frame,
                state._blender.pose,
                observations,
                state._desired,
            )
            updates(*given)
            cost[mode] = best_us(lambda given=given: updates(*given), UPDATES) / len(model.SECTIONS)
        print(
            f"  update of one section: {cost['exact']:.1f} us exact, {cost['expected']:.1f} us expected "
            f"({cost['exact'] / cost['expected']:.1f} times)"
        )
        for fps in (FPS, 60.0):
            times = hop_times(models["exact"], heard, fps, 5)
            for title, row in (("one pass", times[0]), ("best of five", times.min(axis=0))):
                p50, p99, p999 = np.quantile(row, [0.5, 0.99, 0.999])
                print(f"  hop at {fps:g} fps, {title:12}: p50 {p50:5.1f}  p99 {p99:5.1f}  p99.9 {p999:6.1f} us")
        memory = [held_kb(models["exact"], heard[: len(heard) // part]) for part in (10, 1)]
        print(f"  memory of a state after 1 minute {memory[0]:.0f} kB, after 10 minutes {memory[1]:.0f} kB")


if __name__ == "__main__":
    main()
