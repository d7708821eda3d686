"""Time one EM iteration and Viterbi decoding against hmmlearn, in one run: python bench/markov.py [frames ...]

Both sides hold the same parallel HMM (hmmlearn a dense transition matrix, in its faster implementation, ``scaling``),
start from the same parameters, see the same six features in float64, and work in one thread. The log-likelihoods must
agree to 1e-9, else the run ends with an error. Ours is the best of several runs, hmmlearn's of as many as stay short.
"""

from __future__ import annotations

import ctypes
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
from hmmlearn.hmm import GaussianHMM

from cospeech.markov import parallel
from cospeech.markov.parallel import ParallelHMM

FEATURES = 6
SETTINGS = ((8, 3), (16, 9))
LENGTHS = (4_800, 48_000, 288_000)  # 2 minutes, 20 minutes, 2 hours at 40 frames a second
FLOOR = np.full(FEATURES, 1e-3)


def planted(branches: int, states: int, rng: np.random.Generator) -> ParallelHMM:
    """Return a model whose states overlap as those of prosody do."""
    return ParallelHMM(
        rng.dirichlet(np.full(branches, 5.0)),
        rng.uniform(0.7, 0.95, (branches, states)),
        rng.normal(0.0, 1.0, (branches, states, FEATURES)),
        rng.uniform(0.1, 1.0, (branches, states, FEATURES)),
    )


def draw(model: ParallelHMM, n_frames: int, rng: np.random.Generator) -> npt.NDArray[np.float64]:
    """Return frames (T, D) drawn from the model."""
    branch = rng.choice(len(model.entry), n_frames, p=model.entry)
    durations = rng.geometric(1.0 - model.stay[branch]).ravel()
    state = np.repeat(np.arange(durations.size), durations)[:n_frames]
    m, n = branch[state // model.stay.shape[1]], state % model.stay.shape[1]
    return rng.normal(model.mean[m, n], np.sqrt(model.variance[m, n]))


def dense(model: ParallelHMM) -> GaussianHMM:
    """Return the same model as hmmlearn's."""
    branches, states, _ = model.mean.shape
    first = np.arange(branches) * states
    transitions = np.diag(model.stay.ravel())
    for place, leave in enumerate(1.0 - model.stay.ravel()):
        if place % states == states - 1:
            transitions[place, first] += leave * model.entry
        else:
            transitions[place, place + 1] += leave
    peer = GaussianHMM(len(transitions), covariance_type="diag", n_iter=1, init_params="", implementation="scaling")
    peer.startprob_ = np.zeros(len(transitions))
    peer.startprob_[first] = model.entry
    peer.transmat_ = transitions
    peer.means_ = model.mean.reshape(-1, FEATURES)
    peer.covars_ = model.variance.reshape(-1, FEATURES)
    return peer


def best_of(task: Callable[[], object], at_least: int, budget_s: float) -> float:
    """Return the shortest time in ms of ``at_least`` runs, and of more while they fit into the budget."""
    times: list[float] = []
    while len(times) < at_least or (sum(times) < budget_s and len(times) < 50):
        begin = time.perf_counter()
        task()
        times.append(time.perf_counter() - begin)
    return 1000 * min(times)


def peak_mb(task: Callable[[], object]) -> float:
    """Return how far the resident memory rises in a task above what it was before, in MB (Linux only, else nan)."""
    try:
        ctypes.CDLL(None).malloc_trim(0)  # free memory that is kept for reuse would hide what the task takes
        Path("/proc/self/clear_refs").write_text("5")  # the peak counts from here
        before = resident_mb("VmRSS")
        task()
        return resident_mb("VmHWM") - before
    except (OSError, AttributeError):
        return np.nan


def resident_mb(field: str) -> float:
    """Return a field of this process's memory status in MB."""
    status = Path("/proc/self/status").read_text()
    return next(int(line.split()[1]) for line in status.splitlines() if line.startswith(field)) / 1024


def main() -> None:
    """Print a line for each setting and length."""
    lengths = tuple(int(argument) for argument in sys.argv[1:]) or LENGTHS
    print(f"One EM iteration and Viterbi, D = {FEATURES}, one thread, float64; best of several runs in ms")
    print("  M x N        T   EM ours   hmmlearn   ratio   Viterbi ours   hmmlearn   ratio   MB beyond the input")
    for branches, states in SETTINGS:
        rng = np.random.default_rng([branches, states])
        true = planted(branches, states, rng)
        start = true._replace(mean=true.mean + rng.normal(0.0, 0.1, true.mean.shape))
        one_iteration(start, draw(true, 100, rng))
        parallel.decode(start, draw(true, 100, rng))
        for n_frames in lengths:
            compare(start, draw(true, n_frames, rng))


def one_iteration(model: ParallelHMM, frames: npt.NDArray[np.float64]) -> ParallelHMM:
    """Do what ``parallel.fit`` does in an iteration."""
    return parallel.maximise(model, parallel.expect(model, [frames]), FLOOR)


def compare(start: ParallelHMM, frames: npt.NDArray[np.float64]) -> None:
    """Time both sides on one sequence and print the line."""
    beyond = peak_mb(lambda: (one_iteration(start, frames), parallel.decode(start, frames)))
    ours = best_of(lambda: one_iteration(start, frames), 3, 2.0)
    our_viterbi = best_of(lambda: parallel.decode(start, frames), 3, 2.0)
    peer = best_of(lambda: dense(start).fit(frames), 1, 1.0)
    peer_viterbi = best_of(lambda: dense(start).decode(frames), 1, 1.0)
    score, theirs = parallel.log_likelihood(start, frames), dense(start).score(frames)
    if abs(score - theirs) > 1e-9 * abs(theirs):
        sys.exit(f"the log-likelihoods differ: {score} and {theirs}")
    branches, states = start.stay.shape
    print(
        f"{branches:3d} x {states} {len(frames):8d} {ours:9.2f} {peer:10.1f} {peer / ours:6.0f}x {our_viterbi:13.2f} "
        f"{peer_viterbi:10.1f} {peer_viterbi / our_viterbi:6.0f}x {beyond:15.1f}",
        flush=True,
    )


if __name__ == "__main__":
    main()
