"""Quality of motions whose faults are known: jerks at joins, sliding feet, and hands inside the trunk."""

import math

import numpy as np
import pandas as pd
import pytest

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.evaluation import motion_quality as quality
from cospeech.motion import skeleton

FPS = 20.0
ACTORS = {"a1": "a", "a2": "a", "b1": "b"}


def body(n_frames=200, seed=0, root=None, hands_deg=0.0, jump=None, fps=FPS):
    """A standing body that swings its arms; ``jump`` is a frame from which on one forearm is 30 degrees further."""
    rng = np.random.default_rng(seed)
    time = np.arange(n_frames) / fps
    angles = np.zeros((n_frames, len(skeleton.JOINTS), 3))
    for side in ("left", "right"):
        for part in ("arm", "forearm"):
            rate, phase = rng.uniform(0.2, 0.5), rng.uniform(0, 6)
            angles[:, skeleton.JOINTS.index(f"{side}_{part}"), 0] = -40 + 30 * np.sin(2 * np.pi * rate * time + phase)
        angles[:, skeleton.JOINTS.index(f"{side}_hand"), 0] = hands_deg
    if jump is not None:
        angles[jump:, skeleton.JOINTS.index("left_forearm"), 0] -= 30
    return skeleton.motion_table(np.zeros((n_frames, 3)) if root is None else root, angles, fps)


def originals():
    return {(quality.ORIGINAL, record): body(seed=k) for k, record in enumerate(ACTORS)}


def values(table, system, record, column="value"):
    rows = table[(table["system"] == system) & (table["record"] == record)]
    return rows.set_index("quantity")[column]


def test_the_table_follows_its_schema_and_the_recorded_motion_is_its_own_measure():
    found = quality.table(originals(), {}, ACTORS)
    tables.validate(found, "motion_quality", "here")
    for record in ACTORS:
        own, recorded = values(found, quality.ORIGINAL, record), values(found, quality.ORIGINAL, record, "recorded")
        assert own.drop("joins_within").to_dict() == recorded.drop("joins_within").to_dict()
        assert math.isnan(own["joins_within"])
        assert own[["foot_speed", "foot_slip", "off_floor", "frames_deeper"]].tolist() == pytest.approx([0] * 4)
    # One frame of 198 exceeds the percentile of each of the four joints that move.
    assert values(found, quality.ORIGINAL, "b1")["frames_within"] >= 100 * (1 - 4 / 198) - 1e-9
    moving = quality.limits([quality.measure(body())]).acceleration
    assert (moving[[0, 3, 4, 7, 8]] == quality.LEAST_M_S2).all()
    assert (moving[[1, 2, 5, 6]] > quality.LEAST_M_S2).all()
    assert found.groupby("quantity")["unit"].first().to_dict() == quality.UNITS


def test_a_jump_is_found_at_its_join_and_nowhere_else():
    motions = originals() | {("jumps", record): body(seed=k, jump=80) for k, record in enumerate(ACTORS)}
    joins = {("jumps", "a1"): np.array([30, 80, 83, 150]), ("jumps", "a2"): np.array([40, 120])}
    found = quality.table(motions, joins, ACTORS)
    first, second, third = (values(found, "jumps", record) for record in ACTORS)
    assert first["joins_within"] == 75  # frame 83 is far enough from the jump
    assert second["joins_within"] == 100
    assert math.isnan(third["joins_within"])
    assert values(found, "jumps", "a1", "recorded")["joins_within"] == 100
    assert first["frames_within"] < values(found, quality.ORIGINAL, "a1")["frames_within"]
    assert values(found, "jumps", "a1", "n")[["joins_within", "frames_within"]].tolist() == [4, 198]


def test_joins_are_the_starts_of_all_segments_but_the_first():
    assert quality.joins_between(pd.Series([0, 30, 12, 30, 0])).tolist() == [12, 30]
    assert quality.joins_between([]).tolist() == []


def test_feet_slide_as_fast_and_far_as_the_body_does():
    time = np.arange(200) / FPS
    slid = np.column_stack([0.06 * time, 0 * time, 0.08 * time])
    found = quality.table(originals() | {("slides", r): body(root=slid) for r in ACTORS}, {}, ACTORS)
    own = values(found, "slides", "a1")
    assert own["foot_speed"] == pytest.approx(0.1)
    assert own["foot_slip"] == pytest.approx(0.1)
    assert own["off_floor"] == 0


def test_a_lifted_foot_may_move_and_a_body_in_the_air_is_noticed():
    step = np.zeros((200, 3))
    step[100:150, 1] = 0.1  # in the air for a quarter of the time, and 2 m further when it lands
    step[:, 0] = np.interp(np.arange(200), [100, 149], [0.0, 2.0])
    found = quality.table(originals() | {("hops", r): body(root=step) for r in ACTORS}, {}, ACTORS)
    own = values(found, "hops", "a1")
    assert own["off_floor"] == pytest.approx(25)
    assert own["foot_slip"] == 0
    assert own["foot_speed"] == pytest.approx(0)
    sunk = quality.table(
        originals() | {("sunk", r): body(root=-step[[120]].repeat(200, 0)) for r in ACTORS}, {}, ACTORS
    )
    own = values(sunk, "sunk", "a1")
    assert own["off_floor"] == 100
    assert math.isnan(own["foot_speed"])


def plain_depth(turned, placed):
    """The depth in the trunk of one pose, point by point."""
    index = skeleton.JOINTS.index
    deepest = 0.0
    for side in ("left", "right"):
        ends = {name: placed[index(f"{side}_{name}")] for name in ("arm", "forearm", "hand")}
        ends["hand_tip"] = ends["hand"] + turned[index(f"{side}_hand")] @ np.array(skeleton.TIPS_M[f"{side}_hand"])
        for start, end, shares in quality.ARM_POINTS:
            for share in shares:
                point = (1 - share) * ends[start] + share * ends[end]
                for joint, low, high, width, depth, axis in quality.TRUNK:
                    x, y, z = turned[index(joint)].T @ (point - placed[index(joint)])
                    if low <= y <= high:
                        deepest = max(deepest, depth * (1 - math.sqrt((x / width) ** 2 + ((z - axis) / depth) ** 2)))
    return deepest


def test_depth_equals_that_of_a_plain_loop():
    rng = np.random.default_rng(2)
    angles = rng.uniform(-120, 120, (300, len(skeleton.JOINTS), 3))
    turned, placed = skeleton.chain(rng.normal(size=(300, 3)), angles)
    found = quality.trunk_depth(turned, placed)
    assert found == pytest.approx([plain_depth(*pose) for pose in zip(turned, placed, strict=True)], abs=1e-12)
    assert 0.2 < (found > 0).mean() < 0.9
    assert found.max() < max(depth for *_, depth, _ in quality.TRUNK)


def test_a_hand_that_reaches_the_axis_is_half_a_trunk_deep():
    """The forearm is across the belly: the upper arm hangs, and the forearm points inward."""
    angles = np.zeros((2, len(skeleton.JOINTS), 3))
    angles[1, skeleton.JOINTS.index("left_forearm"), 2] = -90.0
    found = quality.trunk_depth(*skeleton.chain(np.zeros((2, 3)), angles))
    assert found[0] == 0
    assert 0.08 < found[1] < 0.112
    motion = skeleton.motion_table(np.zeros((2, 3)), angles, FPS)
    motions = originals() | {("inside", record): motion for record in ACTORS}
    own = values(quality.table(motions, {}, ACTORS), "inside", "a1")
    assert own["trunk_depth"] == pytest.approx(found[1])
    assert own["frames_deeper"] == 50


def test_another_frame_rate_is_refused_and_a_failed_system_left_out():
    with pytest.raises(UserError, match=r"record 'a1' \(other\) has 25 frames/s, but its recorded motion has 20"):
        quality.table(originals() | {("other", "a1"): body(fps=25.0)}, {}, ACTORS)
    failed = {("failed", record): body(seed=5)[: 0 if record == "b1" else None] for record in ACTORS}
    pd.testing.assert_frame_equal(
        quality.table(originals() | failed, {("failed", "a1"): np.array([3])}, ACTORS),
        quality.table(originals(), {}, ACTORS),
    )


def test_very_short_motion_has_the_values_that_exist():
    short = {key: motion.iloc[:1] for key, motion in originals().items()}
    own = values(quality.table(short, {}, ACTORS), quality.ORIGINAL, "a1")
    assert own[["joins_within", "frames_within", "foot_speed", "foot_slip"]].isna().all()
    assert own["off_floor"] == 0
