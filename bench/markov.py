"""Compare the speed of an EM iteration and of Viterbi decoding with hmmlearn: python bench/markov.py [frames ...]

Both have the same parallel HMM (in hmmlearn with a dense transition matrix and its faster implementation,
``scaling``), the same initial parameters and the same six features in float64, and use one thread. Their
log-likelihoods must agree to 1e-9, or the run ends with an error. They take turns; processor times are compared, both
the best and the median of the rounds.

*Limit* is the ratio that ours would reach if it did nothing but its multiplications (counted in the source, each with
or without an addition) at the speed at which this processor multiplies vectors in registers, which is measured in the
same rounds.
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
from threadpoolctl import threadpool_limits

from cospeech.kernels.jit import njit
from cospeech.markov import lanes, parallel
from cospeech.markov.lanes import LANES
from cospeech.markov.parallel import ParallelHMM
from cospeech.markov.parallel_scaled import BLOCK, KEPT

FEATURES = 6
SETTINGS = ((8, 3), (16, 9))
LENGTHS = (4_800, 48_000, 288_000)  # 2 minutes, 20 minutes and 2 hours at 40 frames per second
FLOOR = np.full(FEATURES, 1e-3)
FORWARD_PRODUCTS = 2 * FEATURES + 14 + 3
EM_PRODUCTS = 5 + 2 * FEATURES
"""Multiplications per frame and state: for a density, its exponential and the forward pass, once in blocks that are
kept and twice in others; and for the rest, the backward pass and the sums."""
VITERBI_PRODUCTS = 2 * FEATURES


def planted(branches: int, states: int, rng: np.random.Generator) -> ParallelHMM:
    """Return a model whose states overlap about as much as those of prosody."""
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
    """Return the model in the form of hmmlearn."""
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


@njit
def multiply(numbers: npt.NDArray[np.float64], times: int) -> None:
    """Multiply and add six vectors at a time, which keeps the multipliers of the processor busy."""
    a, b, c = lanes.take(numbers, (0,)), lanes.take(numbers, (1,)), lanes.take(numbers, (2,))
    d, e, f = lanes.take(numbers, (3,)), lanes.take(numbers, (4,)), lanes.take(numbers, (5,))
    x, y = lanes.take(numbers, (6,)), lanes.take(numbers, (7,))
    for _ in range(times):
        a, b, c, d, e, f = a * x + y, b * x + y, c * x + y, d * x + y, e * x + y, f * x + y
    lanes.put(numbers, (0,), a + b + c + d + e + f)


def in_turn(tasks: dict[str, Callable[[], object]], rounds: int, spell_s: float = 0.1) -> dict[str, list[float]]:
    """Return the processor times of each task in ms, the best of several runs for each round."""
    times: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(rounds):
        for name, task in tasks.items():
            spell: list[float] = []
            while not spell or sum(spell) < spell_s:
                begin = time.process_time()
                task()
                spell.append(time.process_time() - begin)
            times[name].append(1000 * min(spell))
    return times


def peak_mb(task: Callable[[], object]) -> float:
    """Return the peak increase of resident memory during a task in MB (NaN on systems other than Linux)."""
    try:
        ctypes.CDLL(None).malloc_trim(0)  # free memory that is kept for reuse would hide the use of the task
        Path("/proc/self/clear_refs").write_text("5")  # reset the peak
        before = resident_mb("VmRSS")
        task()
        return resident_mb("VmHWM") - before
    except (OSError, AttributeError):
        return np.nan


def resident_mb(field: str) -> float:
    """Return a field of the memory status of this process in MB."""
    status = Path("/proc/self/status").read_text()
    return next(int(line.split()[1]) for line in status.splitlines() if line.startswith(field)) / 1024


def main() -> None:
    """Print one line for each setting and length."""
    lengths = tuple(int(argument) for argument in sys.argv[1:]) or LENGTHS
    print(f"One EM iteration and Viterbi, D = {FEATURES}, one thread, float64; processor time in ms")
    print(
        "  M x N        T   EM ours   hmmlearn   ratio (medians; limit)   Viterbi ours   hmmlearn   "
        "ratio (medians; limit)   MB beyond the input"
    )
    for branches, states in SETTINGS:
        rng = np.random.default_rng([branches, states])
        true = planted(branches, states, rng)
        start = true._replace(mean=true.mean + rng.normal(0.0, 0.1, true.mean.shape))
        one_iteration(start, draw(true, 100, rng))
        parallel.decode(start, draw(true, 100, rng))
        for n_frames in lengths:
            compare(start, draw(true, n_frames, rng))


def one_iteration(model: ParallelHMM, frames: npt.NDArray[np.float64]) -> ParallelHMM:
    """Run one iteration of ``parallel.fit``."""
    return parallel.maximise(model, parallel.expect(model, [frames]), FLOOR)


def compare(start: ParallelHMM, frames: npt.NDArray[np.float64]) -> None:
    """Time both on one sequence and print one line."""
    n_frames, (branches, states) = len(frames), start.stay.shape
    numbers, products = np.full((8, LANES), 0.5), 6 * LANES * 20_000
    beyond = peak_mb(lambda: (one_iteration(start, frames), parallel.decode(start, frames)))
    tasks: dict[str, Callable[[], object]] = {
        "em": lambda: one_iteration(start, frames),
        "viterbi": lambda: parallel.decode(start, frames),
        "multiply": lambda: multiply(numbers, 20_000),
        "peer_em": lambda: dense(start).fit(frames),
        "peer_viterbi": lambda: dense(start).decode(frames),
    }
    with threadpool_limits(1):
        times = in_turn(tasks, rounds=max(1, min(9, 150_000 // n_frames)))
        score, theirs = parallel.log_likelihood(start, frames), dense(start).score(frames)
    if abs(score - theirs) > 1e-9 * abs(theirs):
        sys.exit(f"the log-likelihoods differ: {score} and {theirs}")
    best, median = ({name: of(taken) for name, taken in times.items()} for of in (min, np.median))
    n_vectors = states * -(-branches // LANES)
    product = best["multiply"] / products * n_frames * n_vectors * LANES
    em_products = EM_PRODUCTS + (1.0 + max(0.0, 1.0 - BLOCK * (KEPT // n_vectors) / n_frames)) * FORWARD_PRODUCTS
    print(
        f"{branches:3d} x {states} {n_frames:8d} "
        f"{best['em']:9.2f} {best['peer_em']:10.1f} {best['peer_em'] / best['em']:6.0f}x "
        f"({median['peer_em'] / median['em']:4.0f}x; {best['peer_em'] / product / em_products:4.0f}x) "
        f"{best['viterbi']:17.2f} {best['peer_viterbi']:10.1f} {best['peer_viterbi'] / best['viterbi']:6.0f}x "
        f"({median['peer_viterbi'] / median['viterbi']:4.0f}x; "
        f"{best['peer_viterbi'] / product / VITERBI_PRODUCTS:4.0f}x) {beyond:18.1f}",
        flush=True,
    )


if __name__ == "__main__":
    main()
