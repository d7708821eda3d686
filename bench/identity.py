"""Time word HMMs against hmmlearn, and speaker identification: python bench/identity.py [speakers ...]

Both train the models of 50 speakers, each on five clips of a second, from the same parameters for as many iterations;
their log-likelihoods must agree to 1e-6, or the run ends with an error (probabilities of transitions have limits here
that hmmlearn does not have, and its implementation ``scaling`` underflows with so many features). Processor times of
one core are printed, then those of all strategies and thresholds in four sessions of 50 speakers, and those of one
session and threshold for a growing number of speakers, with the peak memory beyond the features. Features are random,
on which times hardly depend.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd
from hmmlearn.hmm import GaussianHMM
from threadpoolctl import threadpool_limits

from cospeech.identity import sessions, strategies
from cospeech.identity.classifiers import Settings
from cospeech.identity.features import Features
from cospeech.markov import word_hmm
from cospeech.markov.word_hmm import Clips, WordHMMs

SPEAKERS, CLIPS, STATES, ITERATIONS = 50, 5, 6, 10
THRESHOLDS = (0.0, 0.01, 0.02, 0.05, 0.25, 0.3, 0.35, 0.45, 0.5)
FEATURES = {"pair of components": 2, "voice": 39, "voice and lips": 89}
GROWTH = (50, 200, 1000)
GOAL_RATIO, GOAL_S, GOAL_GROWTH_S = 50, 30.0, 600.0


def clips(n_features: int, rng: np.random.Generator) -> Clips:
    """Return five clips of 80 to 119 frames for each speaker."""
    length = rng.integers(80, 120, SPEAKERS * CLIPS)
    frames = noise(rng, int(length.sum()), n_features)
    return Clips(frames, np.cumsum(length) - length, length)


def peers(models: WordHMMs) -> list[GaussianHMM]:
    """Return the models in the form of hmmlearn."""
    found = []
    for stay, mean, variance in zip(*models, strict=True):
        peer = GaussianHMM(len(stay), "diag", n_iter=ITERATIONS, tol=-np.inf, init_params="", covars_prior=0.0,
                           implementation="log")  # fmt: skip
        peer.startprob_ = np.eye(len(stay))[0]
        peer.transmat_ = np.diag(stay) + np.diag(1.0 - stay[:-1], 1)
        peer.means_, peer.covars_ = mean, variance
        found.append(peer)
    return found


def compare(name: str, n_features: int) -> None:
    """Time both on features of one kind and print one line."""
    own, owner = clips(n_features, np.random.default_rng(n_features)), np.repeat(np.arange(SPEAKERS), CLIPS)
    floor = np.full(n_features, 1e-6)
    begun = word_hmm.start(own, owner, SPEAKERS, STATES, floor)
    word_hmm.fit(begun, own, owner, floor, 1)
    taken = []
    for _ in range(3):
        start = time.process_time()
        fit = word_hmm.fit(begun, own, owner, floor, ITERATIONS)
        taken.append(time.process_time() - start)
    theirs, start = peers(begun), time.process_time()
    parts = [own.chosen(np.flatnonzero(owner == speaker)) for speaker in range(SPEAKERS)]
    sequences = [np.concatenate([own.frames[b : b + n] for b, n in zip(one.begin, one.length, strict=True)])
                 for one in parts]  # fmt: skip
    for peer, frames, one in zip(theirs, sequences, parts, strict=True):
        with np.errstate(divide="ignore"):
            peer.fit(frames, one.length)
    peer_s = time.process_time() - start
    scores = [peer.score(frames, one.length) for peer, frames, one in zip(theirs, sequences, parts, strict=True)]
    if not np.allclose(fit.log_likelihoods[-1], scores, rtol=1e-6):
        worst = np.max(np.abs(fit.log_likelihoods[-1] / scores - 1.0))
        sys.exit(f"the log-likelihoods differ by {worst:.1e}")
    print(f"{name:20} D = {n_features:2d}  ours {1e3 * min(taken):8.1f} ms  hmmlearn {1e3 * peer_s:8.0f} ms  "
          f"{peer_s / min(taken):5.0f}x (goal {GOAL_RATIO}x)", flush=True)  # fmt: skip


def population(speakers: int, rng: np.random.Generator) -> Features:
    """Return random features of ten own clips and five of other names for each speaker."""
    rows = [(f"s{speaker:04}", (speaker + k) % speakers, place, k == 0)
            for speaker in range(speakers) for k in range(6) for place in range(10 if k == 0 else 1)]  # fmt: skip
    table = pd.DataFrame(rows, columns=["speaker", "phrase", "repetition", "own_name"])
    length = rng.integers(70, 110, len(table))
    total = int(length.sum())
    table["clip"] = [f"c{number}" for number in range(len(table))]
    return Features(table, np.cumsum(length) - length, length, noise(rng, total, 39), noise(rng, total, 50))


def noise(rng: np.random.Generator, n_frames: int, n_features: int) -> npt.NDArray[np.float64]:
    """Return smooth noise in which every feature is a sum of its neighbours."""
    found = rng.standard_normal((n_frames, n_features))
    found[1:] += found[:-1].copy()
    found[:, 1:] += 0.3 * found[:, :-1].copy()
    return found


def resident_mb(field: str) -> float:
    """Return a field of the memory status of this process in MB; NaN on systems other than Linux."""
    try:
        status = Path("/proc/self/status").read_text()
    except OSError:
        return np.nan
    return next(int(line.split()[1]) for line in status.splitlines() if line.startswith(field)) / 1024


def main() -> None:
    """Print one line for each comparison and size."""
    sizes = tuple(int(argument) for argument in sys.argv[1:]) or GROWTH
    print(f"{ITERATIONS} EM iterations of {SPEAKERS} word models with {STATES} states, one core, float64")
    with threadpool_limits(1):
        for name, n_features in FEATURES.items():
            compare(name, n_features)
        given = population(SPEAKERS, np.random.default_rng(1))
        start = time.process_time()
        for session in sessions.sessions(given.clips):
            strategies.of_session(given, session, Settings(), THRESHOLDS, [], 0.0, 1)
        print(f"all strategies, {len(THRESHOLDS)} thresholds, 4 sessions of {SPEAKERS} x 10: "
              f"{time.process_time() - start:.1f} s (goal {GOAL_S:g} s)", flush=True)  # fmt: skip
        for speakers in sizes:
            given = population(speakers, np.random.default_rng(2))
            features_mb = (given.audio.nbytes + given.lips.nbytes) / 2**20
            before, start = resident_mb("VmRSS"), time.process_time()
            session = sessions.sessions(given.clips)[0]
            strategies.of_session(given, session, Settings(), [0.0], [], 0.0, 1)
            print(f"{speakers:5d} speakers, {len(session.test)} trials: {time.process_time() - start:6.1f} s "
                  f"(goal {GOAL_GROWTH_S:g} s at 1000), features {features_mb:.0f} MB, "
                  f"{resident_mb('VmHWM') - before:.0f} MB beyond", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
