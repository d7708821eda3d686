"""Measure the models of head gestures: python bench/head_gestures.py

- *EM*: one iteration on 20 minutes, compared with hmmlearn with the same dense transition matrix and float64, in one
  thread: stage I for the head (30 frames/s) and the melody (100 Hz), and stage II with one stream, because hmmlearn
  has no model of two. Log-likelihoods must agree to 1e-9, or the run ends with an error. Two streams and the
  input-output HMM follow without a peer. Goal: 30 times as fast.
- *Live*: processor time of each step of 10 ms; each step takes the best of three passes, which is what remains when
  nothing else disturbs. Goal: 60 us at the 99th percentile.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from hmmlearn.hmm import CategoricalHMM, GaussianHMM
from threadpoolctl import threadpool_limits

from cospeech.data.arrays import Floats, Integers
from cospeech.markov import iohmm, parallel, parallel_symbols
from cospeech.markov.parallel import ParallelHMM, flat
from cospeech.markov.parallel_symbols import SymbolHMM
from cospeech.synthesis.head import SETTINGS, SYSTEMS, model
from cospeech.synthesis.live import MELODY, Heard, Stream
from cospeech.synthesis.session import method_of

sys.path.append(str(Path(__file__).parents[1] / "tests" / "synthesis" / "head"))

import planted_heads

MINUTES = 20
ROUNDS = 5


def dense(entry: Floats, stay: Floats) -> tuple[Floats, Floats]:
    """Return initial and transition probabilities of a parallel HMM, written out; state s = n * M + m."""
    n_branches, own = len(entry), flat(stay)
    moves = np.diag(own) + np.diag(1.0 - own[:-n_branches], n_branches)
    moves[-n_branches:, :n_branches] += (1.0 - own[-n_branches:])[:, None] * entry
    return np.append(entry, np.zeros(len(own) - n_branches)), moves


def milliseconds(task: Callable[[], object]) -> float:
    """Return the least processor time of a task."""
    task()
    taken = []
    for _ in range(ROUNDS):
        begin = time.process_time()
        task()
        taken.append(time.process_time() - begin)
    return 1000.0 * min(taken)


def line(name: str, ours: float, theirs: float | None) -> None:
    """Print one comparison."""
    peer = "" if theirs is None else f"   hmmlearn {theirs:9.1f} ms   ratio {theirs / ours:5.0f}x"
    print(f"{name:34s} {ours:8.2f} ms{peer}", flush=True)


def gaussian(name: str, fps: float, branches: int, states: int, features: int) -> None:
    """Compare an iteration of the first stage."""
    rng = np.random.default_rng(features)
    hmm = ParallelHMM(
        rng.dirichlet(np.full(branches, 5.0)),
        rng.uniform(0.7, 0.95, (branches, states)),
        rng.normal(0.0, 1.0, (branches, states, features)),
        rng.uniform(0.1, 1.0, (branches, states, features)),
    )
    frames = rng.normal(0.0, 1.2, (round(60 * MINUTES * fps), features))
    peer = GaussianHMM(hmm.stay.size, "diag", n_iter=1, tol=-np.inf, init_params="", implementation="scaling")
    peer.startprob_, peer.transmat_ = dense(hmm.entry, hmm.stay)
    peer.means_, peer.covars_ = flat(hmm.mean), flat(hmm.variance)
    agree(parallel.log_likelihood(hmm, frames), peer.score(frames))
    floor = np.full(features, 1e-3)
    ours = milliseconds(lambda: parallel.maximise(hmm, parallel.expect(hmm, [frames]), floor))
    line(name, ours, milliseconds(lambda: peer.fit(frames)))


def symbols(name: str, sizes: tuple[int, ...]) -> None:
    """Compare an iteration of the second stage, with a peer if there is one stream."""
    rng = np.random.default_rng(len(sizes))
    hmm = SymbolHMM(
        rng.dirichlet(np.full(6, 5.0)),
        rng.uniform(0.7, 0.95, (6, 4)),
        tuple(rng.dirichlet(np.ones(size), (6, 4)) for size in sizes),
        (1.0,) * len(sizes),
    )
    frames: Integers = np.column_stack([rng.integers(size, size=60 * MINUTES * 30) for size in sizes])
    ours = milliseconds(lambda: parallel_symbols.maximise(hmm, parallel_symbols.expect(hmm, [frames]), 0.0))
    if len(sizes) > 1:
        line(name, ours, None)
        return
    peer = CategoricalHMM(24, n_iter=1, tol=-np.inf, init_params="", implementation="scaling")
    peer.startprob_, peer.transmat_ = dense(hmm.entry, hmm.stay)
    peer.emissionprob_ = flat(hmm.emissions[0])
    agree(parallel_symbols.expect(hmm, [frames]).score, peer.score(frames))
    line(name, ours, milliseconds(lambda: peer.fit(frames)))


def input_output() -> None:
    """Measure an iteration of the input-output HMM."""
    rng = np.random.default_rng(0)
    hmm, n_frames = iohmm.start(5, 24, 5, rng), 60 * MINUTES * 30
    sequence = iohmm.Sequence(rng.integers(5, size=n_frames), rng.integers(5, size=n_frames))
    ours = milliseconds(lambda: iohmm.maximise(hmm, iohmm.expect(hmm, [sequence]), 0.0))
    line("input-output HMM, 24 states", ours, None)


def agree(ours: float, theirs: float) -> None:
    """End the run if two log-likelihoods differ."""
    if abs(ours - theirs) > 1e-9 * abs(theirs):
        sys.exit(f"the log-likelihoods differ: {ours} and {theirs}")


def live() -> None:
    """Measure the steps of the systems that run live, on a minute of planted speech."""
    records = planted_heads.corpus(seed=1)
    trained = model.train(planted_heads.training_of(records, "r0"), SETTINGS)
    melody = np.ascontiguousarray(records["r0"].melody[list(MELODY)].to_numpy())
    for system in SYSTEMS:
        if not system.live:
            continue
        method, passes = method_of(system), []
        for _ in range(3):
            state = method.start(trained, Stream("r0", 0.01, planted_heads.FPS), 1)
            taken = []
            for k in range(len(melody)):
                heard = Heard(k, (k + 0.5) / 100, "", {}, melody=melody[k : k + 1])
                begin = time.thread_time_ns()
                method.step(state, heard)
                taken.append(time.thread_time_ns() - begin)
            passes.append(taken)
        best = np.min(passes, axis=0) / 1000.0
        print(f"{system.name:34s} median {np.median(best):5.1f} us   99 % {np.quantile(best, 0.99):5.1f} us")


def main() -> None:
    """Print all measurements."""
    print(f"One EM iteration on {MINUTES} minutes, one thread, processor time")
    with threadpool_limits(1):
        gaussian("head, 5 x 10 states, 6 features", 30.0, 5, 10, 6)
        gaussian("melody, 5 x 5 states, 3 features", 100.0, 5, 5, 3)
        symbols("joint, 6 x 4 states, one stream", (5,))
        symbols("joint, 6 x 4 states, two streams", (5, 5))
        input_output()
        print("Processor time per step of 10 ms")
        live()


if __name__ == "__main__":
    main()
