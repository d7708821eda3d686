"""Time steps: prosody as it is known, and segments on the grid, against plain loops."""

import math

import numpy as np
from vigorous import arousal, syllables_of

from cospeech.synthesis.controller import steps


def test_prosody_is_that_of_the_latest_syllable_that_is_known_or_a_pause():
    rng = np.random.default_rng(1)
    for _ in range(10):
        table = syllables_of("r", arousal(rng, 12.0), rng)
        step_s = rng.uniform(0.06, 0.1)
        found = steps.prosody(steps.syllables_of(table), int(12.0 / step_s), step_s, -70.0)
        for k, row in enumerate(found):
            known = table[table["known_s"] <= k * step_s]
            latest = known.iloc[-1] if len(known) else None
            silent_s = k * step_s - (latest["end_s"] if latest is not None else 0.0)
            if silent_s > steps.PAUSE_S:
                np.testing.assert_array_equal(row, [-70.0, math.log(min(silent_s, steps.LONGEST_S)), np.nan])
            elif latest is not None:
                length_s = latest["end_s"] - latest["start_s"]
                expected = [latest["intensity_db"], math.log(length_s), latest["f0_hz"]]
                np.testing.assert_array_equal(row, expected)
    assert np.isnan(found[0, 2])  # before the first syllable, there is a pause


def test_prosody_does_not_know_the_future():
    rng = np.random.default_rng(2)
    table = syllables_of("r", arousal(rng, 10.0), rng)
    whole = steps.prosody(steps.syllables_of(table), 125, 0.08, -70.0)
    for k in (0, 3, 40, 90):
        so_far = steps.prosody(steps.syllables_of(table[table["known_s"] <= k * 0.08]), k + 1, 0.08, -70.0)
        np.testing.assert_array_equal(so_far, whole[: k + 1])


def test_segments_that_fill_a_record_fill_its_steps_and_move_by_half_a_step_at_most():
    rng = np.random.default_rng(3)
    dropped = 0
    for _ in range(200):
        per_step, n_frames = int(rng.integers(1, 9)), int(rng.integers(1, 120))
        inner = np.unique(rng.integers(1, n_frames + 1, size=int(rng.integers(0, 12))))
        edges = np.unique([0, *inner, n_frames])
        starts, ends = edges[:-1], edges[1:]
        grid = steps.on_grid(starts, ends, n_frames, per_step)
        n_steps = n_frames // per_step
        assert len(grid.kept) == len(starts)
        dropped += int((~grid.kept).sum())
        if n_steps == 0:
            assert len(grid.start) == 0
            continue
        np.testing.assert_array_equal(grid.start, [0, *grid.end[:-1]])
        assert grid.end[-1] == n_steps
        assert (grid.end > grid.start).all()
        moved = np.abs(grid.start * per_step - starts[grid.kept])
        assert (moved <= np.maximum(per_step / 2, starts[grid.kept] - n_steps * per_step)).all()
    assert dropped > 0


def test_steps_take_a_tenth_of_a_second_at_most_at_the_usual_frame_rates():
    for fps in (12, 20, 24, 25, 29.97, 30, 50, 60, 100, 120):
        step_s = steps.frames_per_step(fps) / fps
        assert 1 / 15 - 1e-9 <= step_s <= 0.1 + 1e-9
