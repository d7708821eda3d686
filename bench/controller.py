"""Time the gesture controller: python bench/controller.py [minutes of motion ...]

*Control layer*: expected distances, successor costs and policy, from the kinematics and poses of a random library
with 926 segments in 11 min 46 s (the length of the standard library of Levine et al. 2010) and 25 hidden states. Its
values are compared with those of plain value iteration on a library of one minute, and must agree to 1e-9, or the run
ends with an error. The paper's times, on a Core i7 of 2.66 GHz, are printed next to ours.

*Inference layer*: 12 minutes of speech and motion at 15 Hz; all of EM, clusters and CRF.

*Live*: each prosody frame of 25 ms, in wall-clock time with garbage collection, over ten minutes of speech: beliefs,
decisions and blended motion of a library of 11 min 46 s at 25 frames per second. Also the time in which a change of
style trains its policy.

*CRF on hard labels*: ours and python-crfsuite (if installed), by L-BFGS with the same features and penalty. Ours must
reach an objective at least as low.

Processor times of one thread, except for the live part.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd
from markov import peak_mb
from threadpoolctl import threadpool_limits

from cospeech.kernels.jit import njit
from cospeech.markov import crf
from cospeech.markov.crf import Targets
from cospeech.motion import skeleton
from cospeech.segmentation import phases
from cospeech.synthesis import live
from cospeech.synthesis.controller import SETTINGS, distances, inference, library, offline, online, policy
from cospeech.synthesis.controller.clusters import Range
from cospeech.synthesis.controller.library import Pieces, Successors
from cospeech.synthesis.interface import Speech, Training

Floats = npt.NDArray[np.float64]

MINUTES = (11 + 46 / 60, 60.0)
SEGMENTS_PER_MINUTE = 926 / MINUTES[0]
STATES, FEATURES, POSES, STEPS_PER_S = 25, 6, 42, 15
DISCOUNT = 0.99
PUBLISHED_S = {MINUTES[0]: 68.5 * 60}
GOALS_S = {MINUTES[0]: 1.0, 60.0: 60.0}
INFERENCE_GOAL_S, MEMORY_GOAL_MB = 3.0, 200.0
HOP_S, LIVE_S, LIVE_GOAL_US, MOTION_FPS = 0.025, 600.0, 60.0, 25.0


class Motion(NamedTuple):
    """A library and the states of an inference layer."""

    cut: Pieces
    known: Successors
    kinematics: Floats
    means: Floats
    covariances: Floats
    transitions: Floats


def motion(minutes: float, rng: np.random.Generator) -> Motion:
    """Return a random library whose poses and kinematics wander from segment to segment."""
    n_segments = round(SEGMENTS_PER_MINUTE * minutes)
    n_frames = np.clip(rng.gamma(2.5, 60 / SEGMENTS_PER_MINUTE * STEPS_PER_S / 2.5, n_segments).round(), 1, 60)
    kinematics, pose = wander(n_segments, FEATURES, 0.8, rng), wander(n_segments + 1, POSES, 0.7, rng) / 2
    cut = library.pieces(n_frames.astype(np.int64))
    share = ((cut.end + 1) / n_frames[cut.segment])[:, None]
    ends = (1 - share) * pose[cut.segment] + share * pose[cut.segment + 1]
    signature = np.column_stack([np.log(n_frames), pose[:-1], kinematics[:, :2]])
    neighbours = library.with_neighbours(signature, np.zeros(n_segments, dtype=np.int64))
    factors = rng.normal(0, 0.3, (STATES, FEATURES, FEATURES))
    covariances = factors @ factors.swapaxes(1, 2) + 0.3 * np.eye(FEATURES)
    transitions = 0.9 * np.eye(STATES) + 0.1 * rng.dirichlet(np.full(STATES, 0.3), STATES)
    known = Successors(ends, pose[:-1], signature, *neighbours, 1.0)
    return Motion(cut, known, kinematics, rng.normal(size=(STATES, FEATURES)), covariances, transitions)


def wander(length: int, features: int, keep: float, rng: np.random.Generator) -> Floats:
    """Return an autoregressive sequence (T, D) of variance 1."""
    values = rng.normal(size=(length, features))
    for t in range(1, length):
        values[t] = keep * values[t - 1] + np.sqrt(1 - keep**2) * values[t]
    return values


def control_layer(made: Motion) -> policy.Policy:
    """Return the policy of a library, from its motion on."""
    rows = library.cost_rows(made.cut, made.known)
    delta = distances.expected_distances(made.kinematics, made.means, made.covariances)
    return policy.solve(made.cut, rows, delta, made.transitions, DISCOUNT)


@njit
def sweep(segment, closing, first, costs, shown, factors, powers, values, new):
    """Run one sweep of plain value iteration."""
    n_states = values.shape[1]
    for b in range(len(segment)):
        for i in range(n_states):
            best = np.inf
            for a in range(len(first) - 1):
                target = b + 1 if a == segment[b] and not closing[b] else first[a]
                jump = 0.0 if target == b + 1 and not closing[b] and a == segment[b] else costs[b, a]
                x = jump
                for j in range(n_states):
                    x += powers[b, i, j] * values[target, j]
                best = min(best, x)
            new[b, i] = shown[b, i] + factors[b] * best


def plain_values(made: Motion, sweeps: int) -> Floats:
    """Return the values by plain value iteration over all pairs of pieces and segments."""
    cut, costs = made.cut, library.successor_costs(made.cut, made.known)
    delta = distances.expected_distances(made.kinematics, made.means, made.covariances)
    ahead = [np.eye(STATES)]
    while len(ahead) <= cut.length.max():
        ahead.append(ahead[-1] @ made.transitions)
    shown = np.array(
        [
            sum(DISCOUNT**g * ahead[g] @ delta[a] for g in range(n))
            for a, n in zip(cut.segment, cut.length, strict=True)
        ]
    )
    powers = np.array([ahead[n] for n in cut.length])
    values, new = np.zeros_like(shown), np.empty_like(shown)
    for _ in range(sweeps):
        sweep(cut.segment, cut.closing, cut.first, costs, shown, DISCOUNT**cut.length, powers, values, new)
        values, new = new, values
    return values


def took(task: Callable[[], object], runs: int = 1) -> float:
    """Return the shortest processor time of some runs in seconds."""
    times = []
    for _ in range(runs):
        begin = time.process_time()
        task()
        times.append(time.process_time() - begin)
    return min(times)


def control(minutes: float, rng: np.random.Generator) -> None:
    """Time the control layer of a library and print one line."""
    made = motion(minutes, rng)
    beyond = peak_mb(lambda: control_layer(made))
    run_s = took(lambda: control_layer(made), 5 if minutes < 20 else 1)
    found, rows = control_layer(made), library.cost_rows(made.cut, made.known)
    row, belief = rows(slice(1, 2))[0], np.full(STATES, 1 / STATES)
    decision_us = 1e6 * took(lambda: [policy.decide(found, made.cut, row, 1, belief) for _ in range(1000)], 5) / 1000
    published = f"{PUBLISHED_S[minutes]:8.0f}" if minutes in PUBLISHED_S else "       -"
    goal = f"{GOALS_S[minutes]:6.0f}" if minutes in GOALS_S else "     -"
    print(
        f"{minutes:7.1f} {len(made.kinematics):9d} {run_s:9.2f} {goal} {published} "
        f"{found.iterations:11d} {found.error_bound:12.1e} {beyond:6.0f} {decision_us:14.1f}",
        flush=True,
    )


def speech_and_motion(n_steps: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return kinematics (T, 6) and prosody (T, 3) of a hidden chain; both are held for a few steps."""
    state = np.repeat(rng.integers(STATES, size=n_steps), rng.integers(4, 20, n_steps))[:n_steps]
    centres = np.random.default_rng(1).normal(size=(STATES, FEATURES + 3))
    kinematics = centres[state, :FEATURES] + np.repeat(rng.normal(0, 0.5, (n_steps, FEATURES)), 4, axis=0)[:n_steps]
    prosody = centres[state, FEATURES:] + np.repeat(rng.normal(0, 1.0, (n_steps, 3)), 3, axis=0)[:n_steps]
    prosody[rng.random(n_steps) < 0.3, -1] = np.nan
    return kinematics, prosody * [6.0, 0.3, 30.0] + [60.0, -1.5, 150.0]


def against_crfsuite(rng: np.random.Generator) -> None:
    """Time training on known labels next to python-crfsuite."""
    try:
        import pycrfsuite
    except ModuleNotFoundError:
        print("CRF on hard labels: skipped, python-crfsuite is not installed")
        return
    labels = [np.repeat(rng.integers(STATES, size=300), rng.integers(3, 9, 300)) for _ in range(3)]
    # Not negative: python-crfsuite leaves out features whose sum is.
    sequences = [np.exp(np.eye(STATES)[label] + rng.normal(0, 1.0, (len(label), STATES))) for label in labels]
    targets = []
    for label in labels:
        beliefs = np.eye(STATES)[label]
        targets.append(Targets(beliefs, beliefs[:-1].T @ beliefs[1:]))
    trainer: Any = pycrfsuite.Trainer(algorithm="lbfgs", verbose=False)
    trainer.set_params({"c1": 0.0, "c2": 0.5, "max_iterations": 1000, "epsilon": 1e-5, "delta": 1e-8, "period": 10})
    trainer.set_params({"feature.possible_states": True, "feature.possible_transitions": True})
    for values, label in zip(sequences, labels, strict=True):
        items = [{str(f): float(x) for f, x in enumerate(row)} for row in values]
        trainer.append(pycrfsuite.ItemSequence(items), [str(i) for i in label])
    with tempfile.TemporaryDirectory() as folder:
        theirs_s = took(lambda: trainer.train(str(Path(folder) / "model.crfsuite")))
    theirs = trainer.logparser.last_iteration["loss"]
    reached, iterations = np.inf, 40
    while reached > theirs and iterations < 1000:
        iterations += iterations // 4
        reached = crf.fit(sequences, targets, 1.0, iterations, 0.0).objective
    ours_s = took(lambda: crf.fit(sequences, targets, 1.0, iterations, 0.0))
    print(
        f"CRF on hard labels, {sum(map(len, labels))} steps: ours {ours_s:.2f} s to {reached:.4f} "
        f"({iterations} iterations), python-crfsuite {theirs_s:.2f} s to {theirs:.4f}: {theirs_s / ours_s:.1f}x"
    )
    if reached > theirs:
        sys.exit("our objective is larger than that of python-crfsuite")


def moving(duration_s: float, rng: np.random.Generator) -> pd.DataFrame:
    """Return the motion of arms that move and rest."""
    n_frames = round(duration_s * MOTION_FPS)
    active = np.repeat(rng.random(n_frames // 15 + 1) < 0.6, 15)[:n_frames]
    turns = wander(n_frames, len(skeleton.JOINTS) * 3, 0.98, rng).reshape(n_frames, -1, 3) * active[:, None, None]
    smooth = np.cumsum(turns, axis=0) - np.cumsum(turns, axis=0).mean(axis=0)
    angles = 25.0 * np.sin(smooth / 40.0)
    return skeleton.motion_table(np.zeros((n_frames, 3)), angles, MOTION_FPS)


def talking(duration_s: float, rng: np.random.Generator) -> pd.DataFrame:
    """Return four syllables per second, a quarter of them unvoiced."""
    start = np.arange(0.1, duration_s - 0.5, 0.25)
    voiced = rng.random(len(start)) > 0.25
    table = pd.DataFrame({"record": "r", "syllable": np.arange(len(start)), "start_s": start, "peak_s": start + 0.1})
    table["end_s"], table["known_s"] = start + 0.22, start + 0.24
    table["f0_hz"] = np.where(voiced, rng.normal(150, 30, len(start)), np.nan)
    table["f0_rise_hz"] = table["f0_fall_hz"] = 0.0
    return table.assign(intensity_db=rng.normal(-30, 6, len(start)))


def live_controller(rng: np.random.Generator) -> None:
    """Time each prosody frame of a live controller."""
    motions = {f"r{n}": moving(MINUTES[0] * 60 / 4, rng) for n in range(4)}
    syllables = {name: talking(MINUTES[0] * 15, rng) for name in motions}
    found = phases.find(motions, {"threshold": 0.25, "minimum_s": 0.1})
    by_record = {str(name): table.reset_index(drop=True) for name, table in found.groupby("record")}
    training = Training(
        "actor", HOP_S, (), (), {}, {}, motions=motions, syllables=syllables, phases=by_record
    )  # fmt: skip
    model = online.train(training, {**SETTINGS, "states": [STATES]})
    speech = Speech("r", HOP_S, round(LIVE_S / HOP_S), syllables=talking(LIVE_S, rng))
    state = online.start(model, live.Stream("r", HOP_S, MOTION_FPS), 1)
    hops = list(live.frames(speech))
    online.step(state, hops[0])
    begin = time.process_time()
    online.prepare(state, "style:energetic", 0.7)()
    style_ms = 1000 * (time.process_time() - begin)
    times = np.empty(len(hops) - 1)
    for place, hop in enumerate(hops[1:]):
        begin = time.perf_counter()
        online.step(state, hop)
        times[place] = time.perf_counter() - begin
    p50, p99 = 1e6 * np.percentile(times, [50, 99])
    print(
        f"live, {len(model.control.kinematics)} segments, {STATES} states: {p50:.0f} µs per {1000 * HOP_S:.0f} ms in "
        f"the median, {p99:.0f} at the 99th percentile, goal {LIVE_GOAL_US:.0f}; a change of style: {style_ms:.0f} ms"
    )


def main() -> None:
    """Print times, goals and the paper's times."""
    minutes = tuple(float(argument) for argument in sys.argv[1:]) or MINUTES
    rng = np.random.default_rng(0)
    with threadpool_limits(1):
        small = motion(1.0, rng)
        found, plain = control_layer(small).values, plain_values(small, 3000)
        apart = float(np.abs(found / plain - 1.0).max())
        if apart > 1e-9:
            sys.exit(f"the policy differs from plain value iteration by {apart:.1e}")
        print(f"values of one minute of motion differ from plain value iteration by {apart:.1e} at most")
        print(f"control layer, {STATES} states; goal for memory: {MEMORY_GOAL_MB:g} MB beyond the input")
        print("minutes  segments    time s   goal  paper s  iterations  error bound     MB  µs per decision")
        for one in minutes:
            control(one, rng)
        made = motion(5.0, rng)
        delta = distances.expected_distances(made.kinematics, made.means, made.covariances)
        rows, beliefs = library.cost_rows(made.cut, made.known), rng.dirichlet(np.full(STATES, 0.2), 900)
        offline.animate(made.cut, rows, delta, beliefs[:2])
        frame_ms = 1000 * took(lambda: offline.animate(made.cut, rows, delta, beliefs), 3) / 900
        print(f"offline animation: {frame_ms:.2f} ms per time step, {len(delta)} segments")
        parts = [speech_and_motion(12 * 60 * STEPS_PER_S // 5, rng) for _ in range(5)]
        kinematics, prosody = zip(*parts, strict=True)
        settings, f0 = inference.Settings(), Range(60.0, 400.0)
        inference.train(kinematics[:1], prosody[:1], f0, settings, 1)  # compiles
        train_s = took(lambda: inference.train(kinematics, prosody, f0, settings, 1), 3)
        print(f"inference layer, 12 minutes at {STEPS_PER_S} Hz: {train_s:.2f} s; goal {INFERENCE_GOAL_S:g} s")
        live_controller(rng)
        against_crfsuite(rng)


if __name__ == "__main__":
    main()
