"""Kalman filter and smoother for moving markers, with a constant-acceleration model, and for angles of the head.

The state of a marker is its position, velocity and acceleration on each axis; the acceleration is driven by white
noise. The three axes share one covariance, because positions are equally accurate on each. A hidden marker is
predicted; the smoother of Rauch, Tung and Striebel (1965) then corrects the prediction from where it reappears.

The state of the head is its angles and their first differences (Sargin 2006, 4.6-4.7).
"""

from __future__ import annotations

import numpy as np

from cospeech.data.arrays import Floats
from cospeech.geometry.cholesky import solve_in_place
from cospeech.kernels.jit import njit

START_SD = (1.0, 1.0, 10.0)
"""Standard deviation of the state before the first observation: m, m/s, m/s^2."""


def motion_model(step_s: float, jerk: float) -> tuple[Floats, Floats]:
    """Return the transition (3, 3) of position, velocity and acceleration in ``step_s`` seconds and its noise (3, 3).

    ``jerk`` is the square root of the spectral density of the white noise in the jerk, m / s^2.5.
    """
    t = step_s
    transition = np.array([[1.0, t, t * t / 2], [0.0, 1.0, t], [0.0, 0.0, 1.0]])
    growth = np.array([[t**5 / 20, t**4 / 8, t**3 / 6], [t**4 / 8, t**3 / 3, t**2 / 2], [t**3 / 6, t**2 / 2, t]])
    return transition, jerk**2 * growth


def difference_model(value_sd: float, difference_sd: float) -> tuple[Floats, Floats]:
    """Return the transition F (2, 2) of a value and its first difference, and its noise (2, 2) (Sargin 2006, 4.7).

    The printed H, two blocks on top of one another, is read as [I 0], which observes the value. With G = I both parts
    of the state have a noise of their own.

    Parameters
    ----------
    value_sd, difference_sd : standard deviation of the noise of each per frame, in the unit of the value.
    """
    return np.array([[1.0, 1.0], [0.0, 1.0]]), np.diag([value_sd**2, difference_sd**2])


@njit
def predict(state: Floats, covariance: Floats, transition: Floats, noise: Floats) -> tuple[Floats, Floats]:
    """Return the state (k, axes), derivative by axis, and the covariance (k, k) one frame later."""
    return transition @ state, transition @ covariance @ transition.T + noise


@njit
def update(state: Floats, covariance: Floats, point: Floats, variance: float) -> tuple[Floats, Floats]:
    """Return state and covariance after an observation ``point`` (axes,) with ``variance`` on each axis."""
    certainty = 1.0 / (covariance[0, 0] + variance)
    after, left = state.copy(), covariance.copy()
    for row in range(len(covariance)):
        gain = covariance[row, 0] * certainty
        for column in range(len(point)):
            after[row, column] += gain * (point[column] - state[0, column])
        for column in range(len(covariance)):
            left[row, column] -= gain * covariance[0, column]
    return after, left


@njit
def _add(values: Floats, total: Floats) -> None:
    """Add values (n, m) to a total; an assignment would take a second to compile because of its error messages."""
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            total[i, j] += values[i, j]


@njit
def filter_and_smooth(
    points: Floats, variances: Floats, transition: Floats, noise: Floats, start: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return the filtered and the smoothed values (T, axes), and the standard deviation (T,) of the latter.

    Parameters
    ----------
    points : (T, axes) observed values, NaN where there is none.
    variances : (T,) of the observations on each axis.
    transition, noise : (k, k) of the state, whose first part is observed.
    start : (k, k) covariance of the state before the first observation; its mean is 0.
    """
    n_frames, n_axes, size = len(points), points.shape[1], len(transition)
    states, covariances = np.zeros((n_frames, size, n_axes)), np.zeros((n_frames, size, size))
    predicted_states, predicted_covariances = np.zeros_like(states), np.zeros_like(covariances)
    state, covariance = np.zeros((size, n_axes)), start
    for frame in range(n_frames):
        if frame > 0:
            state, covariance = predict(state, covariance, transition, noise)
        _add(state, predicted_states[frame])
        _add(covariance, predicted_covariances[frame])
        if np.isfinite(points[frame, 0]):
            state, covariance = update(state, covariance, points[frame], variances[frame])
        _add(state, states[frame])
        _add(covariance, covariances[frame])
    filtered = states[:, 0].copy()
    for frame in range(n_frames - 2, -1, -1):
        gain = transition @ covariances[frame]
        solve_in_place(predicted_covariances[frame + 1].copy(), gain)
        _add(gain.T @ (states[frame + 1] - predicted_states[frame + 1]), states[frame])
        _add(gain.T @ (covariances[frame + 1] - predicted_covariances[frame + 1]) @ gain, covariances[frame])
    return filtered, states[:, 0].copy(), np.sqrt(covariances[:, 0, 0])


def smooth(points_m: Floats, sd_m: Floats, fps: float, jerk: float) -> tuple[Floats, Floats]:
    """Return the smoothed positions (T, 3) of a marker and their standard deviation (T,) on each axis, in metres.

    Parameters
    ----------
    points_m : (T, 3) positions; NaN where the marker is hidden. If it is always hidden, the result is NaN.
    sd_m : (T,) standard deviation of each position on each axis.
    fps : frames per second.
    jerk : how fast the acceleration changes; see ``motion_model``.
    """
    seen = np.isfinite(points_m[:, 0])
    if not seen.any():
        return np.full(points_m.shape, np.nan), np.full(len(points_m), np.nan)
    middle = points_m[seen].mean(axis=0)
    transition, noise = motion_model(1.0 / fps, jerk)
    start = np.diag(np.square(START_SD))
    _, smoothed, sd = filter_and_smooth(points_m - middle, np.square(sd_m), transition, noise, start)
    return smoothed + middle, sd
