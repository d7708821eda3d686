"""The Kalman filter and smoother of moving markers, with constant acceleration between frames.

The state of a marker is its position, velocity and acceleration on each axis; what changes the acceleration is white
noise. The three axes share their covariance, as a position is equally sure on each. A hidden marker moves on as
predicted; the smoother of Rauch, Tung and Striebel (1965) then draws it to where it reappears.
"""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.kernels.jit import njit

START_SD = (1.0, 1.0, 10.0)
"""What is not known of a marker before its first sight: metres, metres a second, metres a second squared."""


def transition(step_s: float, jerk: float) -> tuple[Floats, Floats]:
    """Return the transition (3, 3) of position, velocity and acceleration in ``step_s`` seconds and its noise (3, 3).

    ``jerk`` is the spectral density of the white noise on the acceleration's change, metres a second to the 2.5.
    """
    t = step_s
    move = np.array([[1.0, t, t * t / 2], [0.0, 1.0, t], [0.0, 0.0, 1.0]])
    spread = np.array([[t**5 / 20, t**4 / 8, t**3 / 6], [t**4 / 8, t**3 / 3, t**2 / 2], [t**3 / 6, t**2 / 2, t]])
    return move, jerk**2 * spread


@njit
def predict(state: Floats, cover: Floats, move: Floats, noise: Floats) -> tuple[Floats, Floats]:
    """Return the state (3, 3: order, axis) and covariance (3, 3) one frame later."""
    return move @ state, move @ cover @ move.T + noise


@njit
def update(state: Floats, cover: Floats, point: Floats, variance: float) -> tuple[Floats, Floats]:
    """Return the state and covariance after seeing the position ``point`` (3,), ``variance`` on each axis, m^2."""
    certainty = 1.0 / (cover[0, 0] + variance)
    after, left = state.copy(), cover.copy()
    for row in range(3):
        gain = cover[row, 0] * certainty
        for column in range(3):
            after[row, column] += gain * (point[column] - state[0, column])
            left[row, column] -= gain * cover[0, column]
    return after, left


@njit
def _smooth(points: Floats, variances: Floats, move: Floats, noise: Floats, start: Floats) -> tuple[Floats, Floats]:
    n_frames = len(points)
    states, covers = np.zeros((n_frames, 3, 3)), np.zeros((n_frames, 3, 3))
    ahead_states, ahead_covers = np.zeros((n_frames, 3, 3)), np.zeros((n_frames, 3, 3))
    state, cover = np.zeros((3, 3)), start
    for frame in range(n_frames):
        if frame > 0:
            state, cover = predict(state, cover, move, noise)
        ahead_states[frame], ahead_covers[frame] = state, cover
        if np.isfinite(points[frame, 0]):
            state, cover = update(state, cover, points[frame], variances[frame])
        states[frame], covers[frame] = state, cover
    for frame in range(n_frames - 2, -1, -1):
        back = np.linalg.solve(ahead_covers[frame + 1], move @ covers[frame]).T
        states[frame] = states[frame] + back @ (states[frame + 1] - ahead_states[frame + 1])
        covers[frame] = covers[frame] + back @ (covers[frame + 1] - ahead_covers[frame + 1]) @ back.T
    return states[:, 0].copy(), np.sqrt(covers[:, 0, 0])


def smooth(points_m: Floats, sd_m: Floats, fps: float, jerk: float) -> tuple[Floats, Floats]:
    """Return the smoothed positions (T, 3) of one marker and their standard deviation (T,) on each axis, metres.

    Parameters
    ----------
    points_m : (T, 3) positions; NaN where hidden.
    sd_m : (T,) standard deviation of each position on each axis.
    fps : frames a second.
    jerk : how briskly the acceleration changes, see ``transition``.

    A marker that is never seen stays NaN.
    """
    seen = np.isfinite(points_m[:, 0])
    if not seen.any():
        return np.full(points_m.shape, np.nan), np.full(len(points_m), np.nan)
    middle = points_m[seen].mean(axis=0)
    move, noise = transition(1.0 / fps, jerk)
    start = np.diag(np.square(START_SD))
    smoothed, sd = _smooth(points_m - middle, np.square(sd_m), move, noise, start)
    return smoothed + middle, sd
