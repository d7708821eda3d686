"""Time Ward's clustering with medoids against scipy's with means: python bench/ward.py [points ...]

Points are drawn around random centres in six dimensions. scipy's clustering is another method, which needs Euclidean
data and no sums over members; its time for the same points says how fast the processor is. The two take turns, and
the best processor time of the rounds is printed. The time for the distances is not included. Memory is that of the
distances and the working memory, as allocated. scipy is left out where its distances would take more than 1 GB.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
from scipy.cluster.hierarchy import ward as scipy_ward
from scipy.spatial.distance import cdist, pdist

from cospeech.segmentation import ward

GOALS_S = {3_000: 0.3, 20_000: 15.0}
DIMENSIONS, CENTRES = 6, 150
MOST_FOR_SCIPY = 15_000


def draw(n_points: int) -> np.ndarray:
    """Return points (N, 6) around random centres."""
    rng = np.random.default_rng(n_points)
    centres = rng.normal(0.0, 1.0, (CENTRES, DIMENSIONS))
    return centres[rng.integers(CENTRES, size=n_points)] + rng.normal(0.0, 0.5, (n_points, DIMENSIONS))


def distances(points: np.ndarray) -> np.ndarray:
    """Return the distances of all points, (N, N), in single precision, without a matrix in double precision."""
    result = np.empty((len(points), len(points)), dtype=np.float32)
    for start in range(0, len(points), 1000):
        result[start : start + 1000] = cdist(points[start : start + 1000], points)
    return result


def seconds(task: Callable[[np.ndarray], object], data: np.ndarray) -> float:
    """Return the processor time of a task."""
    begin = time.process_time()
    task(data)
    return time.process_time() - begin


def main() -> None:
    """Print the times, their ratio and the goals."""
    sizes = [int(size) for size in sys.argv[1:]] or list(GOALS_S)
    ward.tree(distances(draw(20)))  # compile
    for n_points in sizes:
        points = draw(n_points)
        square = distances(points)
        rounds = 5 if n_points <= 5_000 else 1
        ours, theirs = np.inf, np.inf
        condensed = pdist(points) if n_points <= MOST_FOR_SCIPY else None
        for _ in range(rounds):
            ours = min(ours, seconds(ward.tree, square))
            if condensed is not None:
                theirs = min(theirs, seconds(scipy_ward, condensed))
        line = f"{n_points:,} points: {ours:.2f} s, {1.5e-9 * square.nbytes:.1f} GB"
        if condensed is not None:
            line += f"; scipy {theirs:.2f} s, ours takes {ours / theirs:.1f} times as long"
        if n_points in GOALS_S:
            goal = GOALS_S[n_points]
            line += f"; goal {goal:g} s, " + ("reached" if ours <= goal else "MISSED")
        print(line, flush=True)


if __name__ == "__main__":
    main()
