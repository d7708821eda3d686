import numpy as np
import pytest
from actor import FPS, perform
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.data import tables
from cospeech.motion import skeleton
from cospeech.segmentation import movement, phases

SETTINGS = {"threshold": 0.25, "minimum_s": 0.1}
NAMES = list(phases.PARAMETERS)


@pytest.fixture(scope="module")
def motions():
    rng = np.random.default_rng(5)
    return {record: perform(record, rng)[0] for record in ("one", "two")}


@pytest.fixture(scope="module")
def found(motions):
    return phases.find(motions, SETTINGS)


def circling(fps, duration_s=12.0):
    """Hands that circle and drift smoothly, (T, 2, 3), with pauses."""
    times = (np.arange(round(duration_s * fps)) + 0.5) / fps
    beat = np.sin(0.9 * times) ** 2
    one = np.stack([0.3 * beat * np.cos(4 * times), 0.2 * beat * np.sin(4 * times), 0.1 * np.sin(times)], axis=1)
    return np.stack([one, 0.5 * one[:, ::-1]], axis=1) + np.array([[0.2, 0.1, 0.3], [-0.2, -0.1, 0.3]])


def motion_of(hanging_deg, fps):
    """The motion of an actor who swings the left arm forward by angles (T,)."""
    motion = skeleton.standing(len(hanging_deg), fps)
    motion["left_arm_x_deg"] = -np.asarray(hanging_deg)
    return motion


def test_the_table_follows_its_schema_and_covers_every_record(motions, found):
    tables.validate(found, "phases", "phases")
    for record, motion in motions.items():
        rows = found[found["record"] == record]
        np.testing.assert_array_equal(rows["phase"], np.arange(len(rows)))
        np.testing.assert_array_equal(rows["start_frame"], [0, *rows["end_frame"].iloc[:-1]])
        assert rows["end_frame"].iloc[-1] == len(motion)
        assert (rows["active"].to_numpy()[1:] != rows["active"].to_numpy()[:-1]).all()
        assert (rows["end_frame"] - rows["start_frame"]).min() >= 0.1 * FPS


def joined_one_by_one(flags, minimum, keep):
    """The definition of runs without short ones: look through all of them again after every change."""
    flags = flags.copy()
    while True:
        starts, ends = movement.runs(flags)
        spans = list(zip(starts, ends, strict=True))
        short = [(end - start, start, end) for start, end in spans if not (flags[start] and keep[start:end].any())]
        length, start, end = min(short, default=(minimum, 0, 0))
        if length >= minimum or len(spans) == 1:
            return flags
        flags[start:end] ^= True


def test_runs_are_joined_in_the_order_of_their_length():
    rng = np.random.default_rng(8)
    for _ in range(300):
        flags = rng.random(rng.integers(1, 80)) < rng.random()
        keep = flags & (rng.random(len(flags)) < 0.1)
        minimum = int(rng.integers(1, 12))
        found = movement.without_short(flags, minimum, keep)
        np.testing.assert_array_equal(found, joined_one_by_one(flags, minimum, keep))


@given(st.lists(st.booleans(), min_size=1, max_size=60), st.integers(1, 12))
@settings(max_examples=60, deadline=None)
def test_runs_without_short_ones(flags, minimum):
    flags = np.array(flags)
    kept = movement.without_short(flags, minimum)
    starts, ends = movement.runs(kept)
    assert starts[0] == 0
    assert ends[-1] == len(flags)
    np.testing.assert_array_equal(starts[1:], ends[:-1])
    assert len(starts) == 1 or (ends - starts).min() >= minimum
    np.testing.assert_array_equal(movement.without_short(kept, minimum), kept)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=60), st.floats(0.05, 0.5))
@settings(max_examples=60, deadline=None)
def test_hysteresis_lies_between_both_thresholds_and_has_no_direction(speed, low):
    speed = np.array(speed)
    moving = movement.moving(speed, low, 2 * low)
    assert (moving[speed > 2 * low]).all()
    assert not moving[speed <= low].any()
    np.testing.assert_array_equal(movement.moving(speed[::-1], low, 2 * low)[::-1], moving)


@given(st.integers(1, 200), st.integers(1, 200), st.sampled_from([15.0, 20.0, 29.97, 30.0, 60.0, 120.0]))
@settings(max_examples=60, deadline=None)
def test_times_are_those_of_the_frames(first, second, fps):
    spans = movement.table("r", "phase", np.array([0, first]), np.array([first, first + second]), fps)
    np.testing.assert_allclose(spans["start_s"] * fps, spans["start_frame"])
    assert spans["end_s"].iloc[0] == spans["start_s"].iloc[1]
    extents = phases.parameters(
        np.zeros((first + second, 2, 3)), *spans[["start_frame", "end_frame"]].to_numpy().T, fps
    )
    np.testing.assert_allclose(extents[:, 0], np.log(spans["end_s"] - spans["start_s"]), atol=1e-12)


def test_planted_strokes_are_found():
    fps, rest_s, stroke_s = 30.0, 1.0, 0.6
    u = np.linspace(0, 1, round(stroke_s * fps), endpoint=False)
    stroke = 60 * (10 * u**3 - 15 * u**4 + 6 * u**5)  # of minimum jerk
    hold = np.zeros(round(rest_s * fps))
    angles = np.concatenate([hold, stroke, hold + 60, 60 - stroke] * 4 + [hold])
    rows = phases.find({"r": motion_of(angles, fps)}, SETTINGS)
    assert rows["active"].tolist() == [False, True] * 8 + [False]
    expected = np.cumsum([0.0] + [rest_s, stroke_s] * 8)
    np.testing.assert_allclose(rows["start_s"], expected, atol=0.12)


def test_hysteresis_prevents_flicker(motions):
    """With one threshold, a speed that stays close to it crosses it again and again."""
    speeds = {record: phases.speed(phases.hands(motion), FPS) for record, motion in motions.items()}
    low = movement.threshold(speeds.values(), 0.25, 0.0)
    one, two = (
        sum(len(movement.runs(movement.moving(speed, low, high))[0]) for speed in speeds.values())
        for high in (low, 2 * low)
    )
    assert two < 0.9 * one


def test_values_of_a_circular_movement():
    radius_m, turn, fps = 0.2, 2.0, 240.0
    times = np.arange(1200) / fps
    circle = np.stack([radius_m * np.cos(turn * times), radius_m * np.sin(turn * times), 0 * times], axis=1)
    hands = np.stack([circle, circle], axis=1)
    start, end = 120, 1080
    values = np.exp(phases.parameters(hands, np.array([start]), np.array([end]), fps)[0])
    displacement = np.linalg.norm((circle[start:end] - circle[start]).mean(axis=0))
    speed = radius_m * turn
    expected = [(end - start) / fps, *np.sqrt(2) * np.array([displacement, speed, speed * turn, speed**2 * turn])]
    np.testing.assert_allclose(values[:5], expected, rtol=0.015)  # smoothing shrinks the circle by 0.5 %
    assert values[5] == pytest.approx(2 * (circle[start:end, 1].mean() + phases.STANDING_M))


def test_the_unit_of_length_shifts_the_parameters():
    hands, starts, ends = circling(60.0), np.array([0, 200, 410]), np.array([200, 410, 720])
    change = phases.parameters(100 * hands, starts, ends, 60.0) - phases.parameters(hands, starts, ends, 60.0)
    np.testing.assert_allclose(change[:, :5], np.log(100) * np.array([[0, 1, 1, 1, 2]] * 3), atol=1e-9)


def test_walking_and_turning_do_not_change_the_phases(motions, found):
    walked = {}
    for record, motion in motions.items():
        angles = skeleton.angles(motion)
        times = motion["time_s"].to_numpy()
        way = np.zeros((len(motion), 3))
        way[:, 1] = 100.0 + 40.0 * np.sin(times)
        hips = skeleton.rotations(way) @ skeleton.rotations(angles[:, 0])
        angles[:, 0] = skeleton.euler(hips)
        root = np.stack([0.8 * np.sin(0.5 * times), 0 * times + 0.1, 0.4 * times], axis=1)
        walked[record] = skeleton.motion_table(root, angles, FPS)
    moved = phases.find(walked, SETTINGS)
    np.testing.assert_array_equal(moved["start_frame"], found["start_frame"])
    np.testing.assert_allclose(moved[NAMES], found[NAMES], atol=1e-7)


def test_parameters_hardly_depend_on_the_frame_rate():
    bounds_s = np.array([0.0, 2.0, 3.5, 7.0, 12.0])
    rates = [15.0, 30.0, 60.0, 120.0]
    values = {
        fps: phases.parameters(
            circling(fps), *(np.round(b * fps).astype(int) for b in (bounds_s[:-1], bounds_s[1:])), fps
        )
        for fps in rates
    }
    change = np.abs(values[30.0] - values[60.0]).max(axis=0)
    assert (change < [1e-9, 0.06, 0.01, 0.02, 0.03, 0.01]).all()
    coarse = np.abs(values[15.0] - values[120.0]).max()
    assert coarse < 0.2


def test_phases_hardly_depend_on_the_frame_rate():
    """The same smooth movement at 30 and 60 frames per second has the same phases to within one frame."""
    at = {}
    for fps in (30.0, 60.0):
        times = (np.arange(round(20 * fps)) + 0.5) / fps
        angles = 40 * np.sin(1.3 * times) ** 4 + 10 * np.sin(0.4 * times)
        at[fps] = phases.find({"r": motion_of(angles, fps)}, SETTINGS)
    np.testing.assert_allclose(at[30.0]["start_s"], at[60.0]["start_s"], atol=1 / 30 + 1e-9)
    difference = np.abs(at[30.0][NAMES].to_numpy() - at[60.0][NAMES].to_numpy())
    assert np.median(difference) < 0.03


def test_printed_formulas_measure_the_duration():
    """Where movement and duration are independent, so are the parameters; the printed norms of sums are not."""
    rng = np.random.default_rng(3)
    fps = 60.0
    hands = movement.smooth(rng.normal(size=(12_000, 2, 3)), 20.0)
    ends = np.cumsum(np.maximum(6, np.exp(rng.normal(3.3, 0.8, 300)).astype(int)))
    ends = ends[ends < len(hands)]
    starts = np.append(0, ends[:-1])
    values = phases.parameters(hands, starts, ends, fps)
    velocity = movement.rate(movement.smooth(hands, fps), fps)
    for column, vectors in ((2, velocity), (3, movement.rate(velocity, fps))):
        spans = zip(starts, ends, strict=True)
        printed = [np.log(np.linalg.norm(vectors[start:end].mean(axis=0))) for start, end in spans]
        assert np.corrcoef(printed, values[:, 0])[0, 1] < -0.85
        assert abs(np.corrcoef(values[:, column], values[:, 0])[0, 1]) < 0.1
    assert (values[:, 0] < 0).mean() > 0.5  # the printed divisor, the logarithm of the duration, is often negative


def test_a_speaker_who_does_not_move():
    rows = phases.find({"r": skeleton.standing(40, 20.0), "short": skeleton.standing(1, 20.0)}, SETTINGS)
    assert rows["active"].tolist() == [False, False]
    assert np.isfinite(rows[NAMES]).all(axis=None)
    tables.validate(rows, "phases", "phases")


def test_noise_of_hands_at_rest_is_not_movement():
    rng = np.random.default_rng(0)
    motion = skeleton.standing(400, 20.0)
    for name in skeleton.angle_columns(skeleton.ARM_JOINTS):
        motion[name] = rng.normal(0, 0.4, len(motion))
    assert phases.find({"r": motion}, SETTINGS)["active"].tolist() == [False]
