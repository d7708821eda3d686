"""Lip features at the rate of the sound."""

import numpy as np
import pandas as pd

from cospeech.identity import lips
from cospeech.identity.lips.interpolation import COLUMNS


def table(n_frames, values):
    times_s = (np.arange(n_frames) + 0.5) / 15
    frames = pd.DataFrame(np.repeat(values(times_s)[:, None], 50, axis=1), columns=COLUMNS)
    return frames.assign(clip="x", frame=np.arange(n_frames), time_s=times_s, status="aligned"), times_s


def test_splines_pass_through_the_frames_and_follow_a_slow_movement():
    frames, times_s = table(30, lambda t: np.sin(2 * np.pi * t))
    np.testing.assert_allclose(lips.at_rate(frames, times_s)[:, 7], np.sin(2 * np.pi * times_s), atol=1e-12)
    fine_s = (np.arange(20, 180) + 0.5) / 100
    np.testing.assert_allclose(lips.at_rate(frames, fine_s)[:, 0], np.sin(2 * np.pi * fine_s), atol=3e-3)


def test_the_first_and_last_frames_are_repeated_outside():
    frames, _ = table(5, lambda t: t)
    outside = lips.at_rate(frames, np.array([0.0, 9.0]))
    np.testing.assert_allclose(outside[:, 0], [0.5 / 15, 4.5 / 15])


def test_a_single_frame_is_repeated():
    frames, _ = table(1, lambda t: t + 3)
    np.testing.assert_allclose(lips.at_rate(frames, np.arange(4) / 100), 3 + 0.5 / 15)
