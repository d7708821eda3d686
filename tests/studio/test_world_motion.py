"""The motion of the worlds: the planted lag, vigour and strokes can be found in it, and it is a plausible motion."""

import numpy as np
import pandas as pd
import pytest

from cospeech.data import segments, tables
from cospeech.motion import skeleton
from cospeech.segmentation import phases
from cospeech.studio import arousal, features, performance, scenes, worlds

FRAME_S, SEED, FPS = 0.025, 2012, 20.0
STEP_S = 1.0 / 15.0
"""The longest time step of a system that infers arousal."""


def player(world, actor="ada"):
    return scenes.player(actor, world, SEED, FRAME_S, 10.0)


def take(world, record, duration_s, coupling, actor="ada", fps=FPS):
    """Return a scene and its motion table."""
    own = player(world, actor)
    planted = scenes.write(own, record, duration_s, worlds.couplings(world, coupling, {}), FRAME_S, SEED)
    return planted, performance.perform(actor, record, planted, fps, SEED)


def places(moved):
    return skeleton.forward(moved[list(skeleton.ROOT_COLUMNS)].to_numpy(), skeleton.angles(moved))


def hand_speed(moved, fps=FPS):
    """Return the mean speed (T,) of both hands in metres per second."""
    found = places(moved)
    hands = np.stack([found["left_hand"], found["right_hand"]], axis=1)
    return np.linalg.norm(np.gradient(hands, 1.0 / fps, axis=0), axis=2).mean(axis=1)


@pytest.fixture(scope="module")
def vigour():
    """Half an hour of two actors in the world ``vigour`` at coupling 0.8, in records of ten minutes."""
    return {
        actor: [take("vigour", f"{actor}_{k}", 600.0, 0.8, actor) for k in range(3)] for actor in ("ada", "deniz")
    }


def level_of_syllables(record, planted, times_s):
    """Return the level of the voiced syllables that a listener finds, minus its mean, at each time; 0 elsewhere."""
    delivery = planted.delivery()
    found = features.syllables(record, planted.prosody, delivery.syllables, 170.0, SEED, delivery.contours)
    found = found[found["f0_hz"].notna()]  # unvoiced ends are softer whatever the arousal
    row = np.clip(np.searchsorted(found["start_s"], times_s, side="right") - 1, 0, None)
    inside = (times_s >= found["start_s"].iloc[0]) & (times_s < found["end_s"].to_numpy()[row])
    level = found["intensity_db"].to_numpy()[row]
    return np.where(inside, level - level[inside].mean(), 0.0)


def lag_s(pairs):
    """Return the time by which the first signals of records are ahead of the second: the peak of a parabola through
    their cross-correlation."""
    shifts = np.arange(-10, 25)
    total = np.zeros(len(shifts))
    for early, late in pairs:
        inner = early[40:-40] - early.mean()
        total += [inner @ late[40 + shift : len(late) - 40 + shift] for shift in shifts]
    best = int(total.argmax())
    near = slice(max(best - 8, 0), best + 9)
    bend, slope, _ = np.polyfit(shifts[near] / FPS, total[near], 2)
    return -slope / (2.0 * bend)


def test_the_planted_lag_is_found_in_the_motion(vigour):
    times_s = segments.frame_times(12_000, FPS)
    for actor, takes in vigour.items():
        planted_s = player("vigour", actor).arousal_model.lag_s
        speeds = [np.log(hand_speed(moved) + 0.02) for _, moved in takes]
        states = [arousal.effect(planted.spoken, (-1.0, 0.0, 1.0), times_s) for planted, _ in takes]
        assert lag_s(zip(speeds, states, strict=True)) == pytest.approx(planted_s, abs=STEP_S)
        levels = [level_of_syllables(f"{actor}_{k}", planted, times_s) for k, (planted, _) in enumerate(takes)]
        assert lag_s(zip(speeds, levels, strict=True)) == pytest.approx(planted_s, abs=STEP_S)


def test_speech_tells_how_fast_the_hands_are_at_coupling_1_and_nothing_at_coupling_0():
    """At coupling 0, the speech of the record tells no more than that of any other moment."""
    times_s = segments.frame_times(24_000, FPS)

    def correlations(coupling, shifts_s):
        planted, moved = take("vigour", "long", 1200.0, coupling)
        speed, ahead_s = hand_speed(moved), player("vigour").arousal_model.lag_s
        shifted = [(times_s + ahead_s + shift_s) % 1200.0 for shift_s in shifts_s]
        return [np.corrcoef(speed, arousal.effect(planted.spoken, (0.0, 1.0, 2.0), at_s))[0, 1] for at_s in shifted]

    assert correlations(1.0, [0.0])[0] > 0.45
    own, *wrong = correlations(0.0, [0.0, *np.linspace(30.0, 1170.0, 60)])
    assert min(wrong) <= own <= max(wrong)


def test_every_kinematic_parameter_rises_with_arousal(vigour):
    """Speed, extent, acceleration, curvature and height of gesture phases (Levine et al. 2010, 5.1), over time."""
    takes = dict(enumerate(vigour["ada"]))
    found = phases.find({str(k): moved for k, (_, moved) in takes.items()}, {"threshold": 0.25, "minimum_s": 0.1})
    middle_s = (found["start_s"] + found["end_s"]).to_numpy() / 2
    state = np.concatenate(
        [
            arousal.effect(takes[int(record)][0].shown, (0.0, 1.0, 2.0), middle_s[found["record"] == record])
            for record in found["record"].unique()
        ]
    )
    weights = (found["end_s"] - found["start_s"]).to_numpy()
    for name in ("spatial_extent", "velocity", "acceleration", "curvature", "height"):
        typical = [np.average(found[name][state == one], weights=weights[state == one]) for one in range(3)]
        assert typical[0] < typical[1] < typical[2], name


@pytest.fixture(scope="module", params=["syllables", "all"])
def strokes(request):
    """Five minutes at 60 frames per second in a world with strokes on syllables."""
    return (request.param, *take(request.param, "strokes", 300.0, 0.8, fps=60.0))


def test_strokes_of_the_motion_start_and_end_as_planned(strokes):
    """Halfway between start and end of a stroke, the limb has gone half of its way, within 50 ms."""
    world, planted, moved = strokes
    found = places(moved)
    courses = {
        "head": skeleton.angles(moved, ("head",))[:, 0],
        "legs": moved[["root_x_m", "root_z_m"]].to_numpy(),
    }
    if world == "syllables":  # in the other one, the hands also move between gesture phrases
        courses["arms"] = np.hstack([found["left_hand"], found["right_hand"]])
    for section, least in (("head", 10.0), ("legs", 0.04), ("arms", 0.25)):
        late_s = []
        table = planted.subunits[planted.subunits["section"] == section]
        for start_s, end_s in table[["start_s", "stroke_end_s"]].to_numpy():
            course = courses.get(section, np.zeros((0, 1)))[round(start_s * 60) : round(end_s * 60) + 1]
            if len(course) < 10 or np.linalg.norm(course[-1] - course[0]) < least:
                continue
            way = (course - course[0]) @ (course[-1] - course[0]) / np.sum((course[-1] - course[0]) ** 2)
            late_s.append((np.argmax(way > 0.5) - (len(course) - 1) / 2) / 60)
        if section in courses:
            assert len(late_s) > 20
            assert np.percentile(np.abs(late_s), 90) < 0.05


def test_hands_are_still_between_a_stroke_and_the_next_syllable(strokes):
    world, planted, moved = strokes
    if world == "all":  # the hands also move between gesture phrases
        return
    speed = hand_speed(moved, 60.0)
    arms = planted.subunits[planted.subunits["section"] == "arms"]
    held, moving = [], []
    for start_s, stroke_end_s, end_s in arms[["start_s", "stroke_end_s", "end_s"]].to_numpy():
        moving.append(speed[round(start_s * 60) : round(stroke_end_s * 60)].mean())
        if end_s - stroke_end_s > 0.15:
            held.append(speed[round(stroke_end_s * 60) + 2 : round(end_s * 60) - 2].mean())
    assert len(held) > 20
    assert np.median(held) < 0.1 * np.median(moving)


@pytest.mark.parametrize("world", ["vigour", "syllables", "all"])
def test_the_motion_is_reproducible_smooth_and_stands_on_its_feet(world):
    planted, moved = take(world, "a", 60.0, 0.8)
    pd.testing.assert_frame_equal(moved, take(world, "a", 60.0, 0.8)[1])
    tables.validate(moved, "motion", "a")
    assert len(moved) == 1200
    found = places(moved)
    for side in ("left", "right"):
        foot = found[f"{side}_foot"]
        assert np.ptp(foot, axis=0).max() < 2e-3
    speed = hand_speed(moved)
    assert 0.05 < np.median(speed) < 1.0
    assert speed.max() < 8.0
    assert np.abs(np.diff(skeleton.angles(moved), axis=0)).max() < 100.0
    assert planted.gestures["end_frame"].iloc[-1] == 2400
