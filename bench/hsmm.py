"""Compare the time of HSMM decoding with that of its inner maximisation alone: python bench/hsmm.py

Seven states, 400 duration bins, eight symbols. The candidates are all (end frame, state, duration): T x 7 x 400 sums
of two numbers, of which the largest is needed for each end frame and state. *Bare* does only that, with all offers
known beforehand, in two ways: vectorised over end frames (the fastest way we know), and with a loop over the
durations of one end frame. The decoder computes the offers on its way, adds emissions and transitions, and traces
back. The tasks take turns, and both the best and the median of their times are compared. *Dense* durations all
differ; *counted* ones, as from 20 segments per state, mostly equal the floor.
"""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from cospeech.kernels.jit import njit
from cospeech.markov import hsmm, hsmm_kernels
from cospeech.markov.hsmm_kernels import BLOCK

STATES, BINS, SYMBOLS = 7, 400, 8
LENGTHS = (4_800, 48_000, 288_000)  # 2 minutes, 20 minutes and 2 hours at 40 frames per second
GOAL = 2.0


@njit
def bare_lanes(offer, durations, ending):
    """Push known offers as ``best_scores`` does."""
    n_states, n_frames = ending.shape
    n_bins = durations.shape[1] - BLOCK
    for first in range(0, n_frames - n_bins - 2 * BLOCK, BLOCK):
        beyond = first + BLOCK
        for j in range(n_states):
            hsmm_kernels._push(ending[j, beyond : beyond + n_bins], offer[j, first:beyond], durations[j], n_bins)


@njit
def bare_loop(offer, durations, ending):
    """Loop over the durations of each end frame and state, as eq. 5.9 is written."""
    n_states, n_frames = ending.shape
    n_bins = durations.shape[1] - BLOCK
    for t in range(1, n_frames - n_bins - 2 * BLOCK):
        for j in range(n_states):
            best = -np.inf
            for k in range(1, min(n_bins, t) + 1):
                best = max(best, offer[j, t - k] + durations[j, k - 1])
            ending[j, t] = best


def best_of(task: Callable[[], object], runs: int) -> float:
    """Return the shortest processor time of several runs, in milliseconds."""
    times = []
    for _ in range(runs):
        begin = time.process_time()
        task()
        times.append(time.process_time() - begin)
    return 1000 * min(times)


def model(rng: np.random.Generator, durations: npt.NDArray[np.float64]) -> hsmm.HSMM:
    """Return a floored model with durations (S, D)."""
    drawn = hsmm.HSMM(
        states=tuple(f"g{i}" for i in range(1, STATES + 1)),
        symbols=tuple(f"p{k}" for k in range(1, SYMBOLS + 1)),
        initial=rng.dirichlet(np.ones(STATES)),
        transitions=rng.dirichlet(np.ones(STATES), STATES),
        emissions=rng.dirichlet(np.ones(SYMBOLS), STATES),
        durations=durations,
    )
    return hsmm.floored(drawn, 1e-6)


def compare(kind: str, planted: hsmm.HSMM, n_frames: int, rng: np.random.Generator) -> None:
    """Time all tasks on a sequence of ``n_frames`` and print one line."""
    held = rng.integers(16, 61, size=n_frames // 16)
    symbols = np.repeat(rng.integers(SYMBOLS, size=len(held)), held)[:n_frames]
    observed = np.array(planted.symbols, dtype=object)[symbols]
    logs = hsmm._logs(planted, observed, 0.25, "none")
    padded = np.full((STATES, BINS + BLOCK), -np.inf)
    padded[:, :BINS] = logs.durations
    offer = rng.normal(size=(STATES, n_frames + BLOCK))
    ending = np.full((STATES, n_frames + BINS + 2 * BLOCK), -np.inf)
    tasks: dict[str, Callable[[], object]] = {
        "lanes": lambda offer=offer, padded=padded, ending=ending: bare_lanes(offer, padded, ending),
        "loop": lambda offer=offer, padded=padded, ending=ending: bare_loop(offer, padded, ending),
        "decode": lambda observed=observed: hsmm.decode(planted, observed, 0.25),
        "sample": lambda observed=observed: hsmm.sample(planted, observed, np.random.default_rng(1), 0.25),
    }
    for task in tasks.values():
        task()  # compile the kernels, or load them from the cache
    took: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(7):  # in turn, so that the load of the machine affects all alike
        for name, task in tasks.items():
            took[name].append(best_of(task, 1 if n_frames > 100_000 else 3))
    best, median = ({name: of(times) for name, times in took.items()} for of in (min, np.median))
    tracemalloc.start()
    tasks["decode"]()
    peak = tracemalloc.get_traced_memory()[1] / 1e6
    tracemalloc.stop()
    print(
        f"{kind:9s} {n_frames:6d} {best['lanes']:13.1f} {best['loop']:12.1f} "
        f"{best['decode']:8.1f} {best['sample']:8.1f} "
        f"{best['decode'] / best['lanes']:15.2f} ({median['decode'] / median['lanes']:.2f}) {peak:27.1f}",
        flush=True,
    )


def main() -> None:
    """Print times, ratios and memory for each kind of durations and each length."""
    rng = np.random.default_rng(0)
    counted = np.zeros((STATES, BINS))
    for lengths in counted:
        np.add.at(lengths, rng.integers(20, 240, size=20), 1.0)
    print(f"HSMM decoding, {STATES} states, {BINS} bins, one thread, float64; processor time in ms")
    print(
        "durations      T   bare, lanes   bare, loop   decode   sample   "
        "decode / bare (medians)   MB beyond the input"
    )
    for kind, durations in (("dense", rng.dirichlet(np.ones(BINS), STATES)), ("counted", counted)):
        planted = model(rng, durations)
        for n_frames in LENGTHS:
            compare(kind, planted, n_frames, rng)
    print(f"goal: decoding within {GOAL:g} times the bare maximisation")
    print("peers (edhsmm, hsmmlearn): skipped, as no release of either installs on this Python; the loop stands in")


if __name__ == "__main__":
    main()
