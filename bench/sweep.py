"""Compare the time of the whole sweep of the thesis with hmmlearn: python bench/sweep.py

Ours is the workflow on two cores, from the features of the demo to the scores of 28 settings in 8 strict folds, with
all process starts, tables and decoding. For hmmlearn only training counts, in one process without its start: the time
of one EM iteration at each of the 28 settings on the frames of the first fold, times the number of iterations that
ours took in all folds and restarts. Initial models, decoding and all that follows are not counted for hmmlearn.
"""

from __future__ import annotations

import os
import time

import numpy as np
from markov import FLOOR, dense
from runs import RUN, snakemake
from runs import folder as bench_folder

from cospeech.data import tables
from cospeech.markov import labelled_hmm, parallel
from cospeech.segmentation import prosody

CLUSTERS, STATES = range(4, 17, 2), (3, 5, 7, 9)
ACTORS, RECORDS = ("ada", "deniz"), 4
FOLDS = [f"{actor}_{number + 1}" for actor in ACTORS for number in range(RECORDS)]
GOAL_S, GOAL_RATIO = 60.0, 50.0


def main() -> None:
    """Print both times, their ratio, and the load of the machine."""
    grid = {"grid": "full", "clusters": list(CLUSTERS), "states": list(STATES)}
    folder = bench_folder("sweep", {"studio": {"film": False}, "sweep": grid})  # features only, no videos
    results = folder / "results" / RUN
    kinds = ("speech/{}/prosody.parquet", "motion/{}.parquet", "corpus/annotations/{}.parquet")
    snakemake(folder, *(f"results/{RUN}/{kind.format(record)}" for record in FOLDS for kind in kinds))
    load_before = os.getloadavg()[0]
    ours = snakemake(folder, f"results/{RUN}/evaluation/session_scores.parquet")

    training = [tables.read(results / f"speech/{record}/prosody.parquet", "prosody") for record in FOLDS[1:RECORDS]]
    sequences = [labelled_hmm.feature_matrix(table, prosody.FEATURES) for table in training]
    frames, lengths = np.concatenate(sequences), [len(sequence) for sequence in sequences]
    theirs_s = kernel_s = 0.0
    for clusters in CLUSTERS:
        for states in STATES:
            place = results / f"phrases/prosody/clusters~{clusters}/states~{states}"
            fits = [tables.read(place / f"fold~{fold}/fit.parquet", "hmm_fit") for fold in FOLDS]
            iterations = sum(int((fit["iteration"] > 0).sum()) for fit in fits)
            known = labelled_hmm.from_table(tables.read(place / f"fold~{FOLDS[0]}/model.parquet", "hmm_model")).hmm
            peer = dense(known)
            begun_s = time.process_time()
            peer.fit(frames, lengths)
            theirs_s += iterations * (time.process_time() - begun_s)
            taken_s = []
            for _ in range(5):  # the first one compiles, and has cold caches
                begun_s = time.process_time()
                parallel.maximise(known, parallel.expect(known, sequences), FLOOR)
                taken_s.append(time.process_time() - begun_s)
            kernel_s += iterations * float(np.median(taken_s))
    print(f"load of the machine before the sweep: {load_before:.1f} on {os.cpu_count()} cores")
    print(
        f"sweep, {len(CLUSTERS) * len(STATES)} settings, {len(FOLDS)} folds, restarts included, features to scores:"
    )
    print(
        f"  ours:     {ours.wall_s:8.1f} s on 2 cores ({ours.cpu_s:.1f} s of processor time, {ours.peak_mb:.0f} MB)"
    )
    print(f"  EM iterations: {kernel_s:.1f} s of processor time")
    print(f"  hmmlearn: {theirs_s:8.1f} s of processor time for the EM iterations alone, on 1 core")
    print(
        f"  ratio:    {theirs_s / ours.wall_s:8.1f} of elapsed times, {theirs_s / ours.cpu_s:.1f} of processor times"
    )
    for reached, goal in (
        (ours.wall_s <= GOAL_S, f"at most {GOAL_S:.0f} s"),
        (theirs_s / ours.wall_s >= GOAL_RATIO, f"{GOAL_RATIO:.0f} times as fast"),
    ):
        print(f"goal {goal}: {'reached' if reached else 'MISSED'}")


if __name__ == "__main__":
    main()
