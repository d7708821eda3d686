"""The filters of figure 6.3 against other programs, and what smoothing around boundaries changes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter1d, median_filter, uniform_filter1d
from scipy.signal import lfilter

from cospeech.motion import skeleton, smoothing

LINEAR = ("exponential", "moving_average", "gaussian")
WINDOWS = (3, 5, 9)


@pytest.fixture
def noise():
    return np.random.default_rng(1).normal(size=(80, 3)).cumsum(axis=0)


@pytest.mark.parametrize("window", WINDOWS)
def test_filters_equal_those_of_scipy(noise, window):
    others = {
        "none": noise,
        "moving_average": uniform_filter1d(noise, window, axis=0, mode="nearest"),
        "gaussian": gaussian_filter1d(noise, (window - 1) / 4, axis=0, mode="nearest", truncate=2.0),
        "median": median_filter(noise, (window, 1), mode="nearest"),
    }
    for name, other in others.items():
        assert smoothing.smooth(noise, name, window) == pytest.approx(other, abs=1e-12)


@pytest.mark.parametrize("window", WINDOWS)
def test_exponential_is_the_recursion_run_forward_and_backward(window):
    impulse = np.zeros(401)
    impulse[200] = 1.0
    factor = 2 / (window + 1)
    forward = lfilter([factor], [1, factor - 1], impulse)
    both = lfilter([factor], [1, factor - 1], forward[::-1])[::-1]
    kept = slice(200 - 2 * window, 200 + 2 * window + 1)  # the kernel is truncated there and normalised
    assert smoothing.kernel("exponential", window) == pytest.approx(both[kept] / both[kept].sum(), rel=1e-9)
    assert both[kept].sum() > 0.95
    assert both[200] == pytest.approx(1 / window)


@given(st.sampled_from(LINEAR), st.integers(1, 12), st.floats(-50, 50), st.floats(-5, 5))
def test_a_steady_movement_stays_as_it_is(name, window, start, speed):
    line = start + speed * np.arange(100.0)
    middle = slice(30, 70)  # away from the ends, where the first and last value are repeated
    assert smoothing.smooth(line, name, window)[middle] == pytest.approx(line[middle], abs=1e-9)


@pytest.mark.parametrize("name", smoothing.FILTERS)
def test_a_window_of_one_frame_changes_nothing(noise, name):
    assert np.array_equal(smoothing.smooth(noise, name, 1), noise)


def test_influence_is_whole_where_phrases_meet_and_ends_after_a_window():
    share = smoothing.influence([20, 60], 80, 5)
    assert share[[19, 20, 59, 60]] == pytest.approx(1)
    assert np.flatnonzero(share).tolist() == [*range(15, 25), *range(55, 65)]
    assert (np.diff(share[20:26]) < 0).all()
    assert (np.diff(share[14:20]) > 0).all()


@pytest.mark.parametrize("name", smoothing.FILTERS)
def test_nothing_changes_far_from_a_boundary(noise, name):
    smoothed = smoothing.around_boundaries(noise, [20, 60], name, 5)
    untouched = smoothing.influence([20, 60], 80, 5) == 0
    assert np.array_equal(smoothed[untouched], noise[untouched])
    assert np.array_equal(smoothing.around_boundaries(noise, [], name, 5), noise)


@given(
    st.sampled_from(LINEAR), st.sampled_from(WINDOWS), st.integers(0, 1000), st.sets(st.integers(20, 80), min_size=1)
)
def test_no_jump_grows_and_a_lone_one_is_divided_by_the_window(name, window, seed, boundaries):
    starts = sorted(boundaries)
    level = np.random.default_rng(seed).normal(size=len(starts) + 1)
    jumping = level[np.searchsorted(starts, np.arange(100), side="right")]
    smoothed = smoothing.around_boundaries(jumping, starts, name, window)
    assert np.abs(np.diff(smoothed)).max() <= np.abs(np.diff(jumping)).max() + 1e-12
    if len(starts) == 1:
        left = abs(np.diff(smoothed)[starts[0] - 1] / np.diff(jumping)[starts[0] - 1])
        assert left == pytest.approx(smoothing.kernel(name, window).max())
        assert left <= (0.8 if name == "gaussian" else 1.05 / window)


def test_median_keeps_an_edge_but_takes_out_a_spike():
    edge = np.repeat([0.0, 1.0], 20)
    assert np.array_equal(smoothing.around_boundaries(edge, [20], "median", 5), edge)
    spike = np.zeros(40)
    spike[20] = 1.0
    assert not smoothing.around_boundaries(spike, [20], "median", 5).any()


@pytest.mark.parametrize("name", smoothing.FILTERS)
def test_the_turn_of_an_angle_past_180_degrees_is_no_jump(name):
    turning = np.linspace(150, 210, 60)
    wrapped = (turning + 180) % 360 - 180
    smoothed = smoothing.around_boundaries(skeleton.unwrap(wrapped), [30], name, 5)
    assert np.abs(smoothed - turning).max() < 1e-9
