"""Time HSMM decoding against the bare inner maximisation over all candidates, in one run: python bench/semi.py

Seven states, 400 duration bins, eight symbols. The candidates are all (end frame, state, duration): T x 7 x 400 sums
of two numbers, of which each end frame and state wants the largest. *Bare* does only that, for offers that are all
known beforehand, in the two ways there are: end frames as lanes (the fastest that we know), and a loop over durations
for one end frame. A decoder finds its offers on the way, adds emissions and transitions, and traces back. All take
turns, and the best and the median of the rounds are compared. *Dense* durations all differ; *counted* ones, as of 20
phrases a state, are the floor but for few.
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
LENGTHS = (4_800, 48_000, 288_000)  # 2 minutes, 20 minutes, 2 hours at 40 frames a second
GOAL = 2.0


@njit
def bare_lanes(offer, durations, ending):
    """Push known offers as ``best_scores`` does, and nothing else."""
    n_states, n_frames = ending.shape
    n_bins = durations.shape[1] - BLOCK
    for first in range(0, n_frames - n_bins - 2 * BLOCK, BLOCK):
        beyond = first + BLOCK
        for j in range(n_states):
            hsmm_kernels._push(ending[j, beyond : beyond + n_bins], offer[j, first:beyond], durations[j], n_bins)


@njit
def bare_loop(offer, durations, ending):
    """For each end frame and state loop over the durations, as eq. 5.9 is written."""
    n_states, n_frames = ending.shape
    n_bins = durations.shape[1] - BLOCK
    for t in range(1, n_frames - n_bins - 2 * BLOCK):
        for j in range(n_states):
            best = -np.inf
            for k in range(1, min(n_bins, t) + 1):
                best = max(best, offer[j, t - k] + durations[j, k - 1])
            ending[j, t] = best


def best_of(task: Callable[[], object], runs: int) -> float:
    """Return the shortest of several times in milliseconds of the processor's time."""
    times = []
    for _ in range(runs):
        begin = time.process_time()
        task()
        times.append(time.process_time() - begin)
    return 1000 * min(times)


def model(rng: np.random.Generator, durations: npt.NDArray[np.float64]) -> hsmm.SemiMarkov:
    """Return a model with these durations (S, D), floored."""
    drawn = hsmm.SemiMarkov(
        states=tuple(f"g{i}" for i in range(1, STATES + 1)),
        symbols=tuple(f"p{k}" for k in range(1, SYMBOLS + 1)),
        initial=rng.dirichlet(np.ones(STATES)),
        transitions=rng.dirichlet(np.ones(STATES), STATES),
        emissions=rng.dirichlet(np.ones(SYMBOLS), STATES),
        durations=durations,
    )
    return hsmm.floored(drawn, 1e-6)


def compare(kind: str, planted: hsmm.SemiMarkov, n_frames: int, rng: np.random.Generator) -> None:
    """Time all ways on a record of so many frames and print the line."""
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
        task()  # compile, or load what was compiled
    took: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(7):  # in turn, so that all meet the same neighbours on the machine
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
    """Print a line for each kind of durations and length: times, ratios, memory."""
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
