import numpy as np
import pytest
from actor import FPS, perform
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.data import tables
from cospeech.motion import skeleton
from cospeech.segmentation import subunits, ward

SETTINGS = {
    "threshold": 0.4,
    "minimum_s": 0.2,
    "longest_s": 2.0,
    "weights": {"length": 0.5, "pose": 0.5, "still_pose": 2.0},
    "members_per_cluster": {"head": 8, "arms": 8, "legs": 8},
}


@pytest.fixture(scope="module")
def motions():
    rng = np.random.default_rng(6)
    return {record: perform(record, rng)[0] for record in ("one", "two")}


@pytest.fixture(scope="module")
def found(motions):
    return subunits.find(motions, SETTINGS)


def traits(rng, n, sizes=(1, 6, 3, 3, 3)):
    parts = tuple(rng.normal(size=(n, size)) for size in sizes)
    return subunits.Traits(parts, rng.uniform(0.2, 2.0, 5), rng.random(n) < 0.5, 3.0)


def naive_distance(one, a, other, b):
    both_still = one.still[a] and other.still[b]
    weights = [one.still_pose if both_still and part == 1 else weight for part, weight in enumerate(one.weights)]
    lengths = [np.linalg.norm(x[a] - y[b]) for x, y in zip(one.parts, other.parts, strict=True)]
    return np.dot(weights, lengths)


def test_every_joint_belongs_to_one_section():
    assert sorted(sum(skeleton.SECTIONS.values(), ())) == sorted(skeleton.JOINTS)


def test_joints_of_high_influence_weigh_more():
    reach = subunits.reach_m()
    for joint, parent in skeleton.PARENT.items():
        assert parent is None or reach[parent] > reach[joint]
    assert reach["left_hand"] == pytest.approx(0.18)
    assert reach["left_forearm"] == pytest.approx(0.43)
    assert reach["chest"] == pytest.approx(np.hypot(0.18, 0.19) + 0.72)


def test_the_tables_follow_their_schema_and_cover_every_record(motions, found):
    for table in found.values():
        tables.validate(table, "subunits", "subunits")
        for record, motion in motions.items():
            rows = table[table["record"] == record]
            np.testing.assert_array_equal(rows["segment"], np.arange(len(rows)))
            np.testing.assert_array_equal(rows["start_frame"], [0, *rows["end_frame"].iloc[:-1]])
            assert rows["end_frame"].iloc[-1] == len(motion)
            assert (rows["end_s"] - rows["start_s"]).max() <= 2.0 + 1e-9
        assert table.groupby("cluster")["medoid"].sum().eq(1).all()
        assert table["cluster"].nunique() == round(len(table) / 8)


def test_head_and_legs_of_an_actor_who_moves_the_arms_are_still(found):
    assert found["head"]["still"].all()
    assert found["legs"]["still"].all()
    assert 0.2 < found["arms"]["still"].mean() < 0.8


@given(
    st.lists(st.tuples(st.integers(1, 50), st.floats(0, 3)), min_size=1, max_size=12),
    st.floats(0.1, 0.5),
    st.floats(0.6, 4.0),
)
@settings(max_examples=60, deadline=None)
def test_boundaries(pieces, minimum_s, longest_s):
    fps, limit = 20.0, 1.0
    turning = np.concatenate([np.full(length, level) for length, level in pieces])
    starts, ends, still = subunits.boundaries(turning, limit, fps, minimum_s, longest_s)
    assert starts[0] == 0
    assert ends[-1] == len(turning)
    np.testing.assert_array_equal(starts[1:], ends[:-1])
    lengths = ends - starts
    assert (lengths > 0).all()
    assert lengths.max() <= longest_s * fps + 1e-9
    cut = still[1:] != still[:-1]  # other boundaries divide long subunits
    for first, last in zip(
        np.append(0, 1 + np.flatnonzero(cut)), np.append(np.flatnonzero(cut), len(cut)), strict=True
    ):
        span = slice(starts[first], ends[last])
        strong = (turning[span] ** 2).sum() >= subunits.STRONG * minimum_s * fps
        long_enough = ends[last] - starts[first] > minimum_s * fps - 1e-6
        assert long_enough or (strong and not still[first]) or not cut.any()


def test_short_movements_are_kept_if_they_are_strong():
    quiet, fps = np.zeros(30), 20.0
    weak, strong = np.full(2, 1.5), np.full(2, 4.0)
    starts, _, still = subunits.boundaries(np.concatenate([quiet, weak, quiet, strong, quiet]), 1.0, fps, 0.2, 99.0)
    assert starts.tolist() == [0, 62, 64]
    assert still.tolist() == [True, False, True]


def test_a_short_dip_separates_two_strokes_where_it_is_slowest():
    """The arm reverses between a stroke and a retraction. A dip without a second stroke separates nothing."""
    dip, stroke = np.array([0.8, 0.1, 0.5]), np.full(10, 3.0)
    turning = np.concatenate([np.zeros(10), stroke, dip, stroke, np.zeros(10)])
    starts, _, still = subunits.boundaries(turning, 1.0, 20.0, 0.2, 99.0)
    assert starts.tolist() == [0, 10, 21, 33]
    assert still.tolist() == [True, False, False, True]
    flutter = np.concatenate([np.zeros(10), stroke, dip, np.full(1, 1.2), np.zeros(10)])
    assert subunits.boundaries(flutter, 1.0, 20.0, 0.2, 99.0)[0].tolist() == [0, 10, 20]


@given(st.integers(0, 10_000))
@settings(max_examples=60, deadline=None)
def test_successive_strokes_are_found_again(seed):
    """Strokes of minimum jerk that follow one another at once, as the studio plans them, and nothing else."""
    rng = np.random.default_rng(seed)
    fps = 20.0
    lengths = rng.integers(9, 16, 12)
    share = [(np.arange(length) + 0.5) / length for length in lengths]
    turning = np.concatenate([rng.uniform(0.7, 1.4) * 30.0 * (u * (1.0 - u)) ** 2 for u in share])
    starts, _, still = subunits.boundaries(turning, 0.15, fps, 0.2, 2.0)
    planned = np.cumsum(lengths)[:-1]
    assert not still.any()
    assert len(starts) == len(lengths)
    assert np.abs(starts[1:] - planned).max() <= 1


def test_long_subunits_are_divided_where_they_are_slow():
    turning = np.full(60, 5.0)
    turning[27] = 2.0
    starts, ends, still = subunits.boundaries(turning, 1.0, 20.0, 0.2, 2.0)
    assert starts.tolist() == [0, 27]
    assert ends.tolist() == [27, 60]
    assert not still.any()


def test_angular_speed_of_one_joint():
    fps, speed = 60.0, 70.0
    motion = skeleton.standing(240, fps)
    motion["left_forearm_x_deg"] = -speed * motion["time_s"]
    reach = subunits.reach_m()
    share = reach["left_forearm"] / sum(reach[joint] for joint in skeleton.SECTIONS["arms"])
    turning = subunits.angular_speed(motion, "arms", fps)[30:-30]
    np.testing.assert_allclose(turning, speed * np.sqrt(share), rtol=0.005)
    for section in ("head", "legs"):
        np.testing.assert_allclose(subunits.angular_speed(motion, section, fps), 0.0, atol=1e-9)


def test_standing_elsewhere_changes_nothing(motions, found):
    """A rigid motion of the whole body, constant over the record."""
    moved = {}
    for record, motion in motions.items():
        angles = skeleton.angles(motion)
        angles[:, 0] = skeleton.euler(
            skeleton.rotations(np.array([0.0, 130.0, 0.0])) @ skeleton.rotations(angles[:, 0])
        )
        moved[record] = skeleton.motion_table(np.tile([1.0, 0.2, -3.0], (len(motion), 1)), angles, FPS)
    for section, table in subunits.find(moved, SETTINGS).items():
        names = ["start_frame", "still", "cluster", "medoid"]
        np.testing.assert_array_equal(table[names], found[section][names])


def test_distances_are_the_weighted_sum_of_their_parts():
    rng = np.random.default_rng(1)
    for _ in range(10):
        one, other = traits(rng, 7), traits(rng, 5)
        other = other._replace(weights=one.weights)
        expected = [[naive_distance(one, a, other, b) for b in range(5)] for a in range(7)]
        np.testing.assert_allclose(subunits.distances(one, other), expected, rtol=1e-5)


def test_parts_are_comparable_after_scaling():
    """The root mean square distance of all pairs is 1 for every part, whatever its unit."""
    rng = np.random.default_rng(2)
    raw = tuple(unit * rng.normal(size=(50, size)) for unit, size in ((1, 1), (100, 6), (0.1, 3), (5, 3), (0.01, 3)))
    weights = SETTINGS["weights"]
    scaled = subunits._scaled([raw], np.zeros(50, dtype=bool), weights)
    for part in scaled.parts:
        squared = ((part[:, None] - part[None]) ** 2).sum(axis=2)
        assert squared[np.triu_indices(50, 1)].mean() == pytest.approx(1.0)
    other = subunits._scaled([tuple(1000 * part for part in raw)], np.zeros(50, dtype=bool), weights)
    for part, same in zip(scaled.parts, other.parts, strict=True):
        np.testing.assert_allclose(part, same)


def test_the_unused_hand_counts_little():
    """Vectors of both hands keep their direction on the logarithmic scale."""
    vectors = np.array([[0.4, 0, 0, 0.01, 0, 0], [0.04, 0, 0, 0.001, 0, 0]])
    scaled = subunits._logarithmic(vectors)
    np.testing.assert_allclose(scaled[:, 3] / scaled[:, 0], 0.025)
    assert 1 < scaled[0, 0] / scaled[1, 0] < 10


def test_planted_gestures_form_clusters():
    """Three kinds of strokes and the poses between them."""
    rng = np.random.default_rng(3)
    poses = {"down": 0.0, "left": 70.0, "right": 70.0}
    columns = {"left": "left_arm_x_deg", "right": "right_arm_x_deg"}
    order = [str(name) for name in rng.permutation(["left", "right"] * 12)]
    blend = np.linspace(0, 1, 12, endpoint=False)
    up = 10 * blend**3 - 15 * blend**4 + 6 * blend**5
    hold = np.ones(20)
    shape = np.concatenate([up, hold, 1 - up, 0 * hold])
    motion = skeleton.standing(len(shape) * len(order), FPS)
    for name, column in columns.items():
        motion[column] = np.concatenate([-poses[name] * shape * (kind == name) for kind in order])
    kinds = [f"{part} {name}" for name in order for part in ("raise", "hold", "lower", "rest")]
    table = subunits.find({"r": motion}, {**SETTINGS, "members_per_cluster": {"head": 8, "arms": 14, "legs": 8}})[
        "arms"
    ]
    assert len(table) == len(kinds)
    kinds = [kind if "rest" not in kind else "rest" for kind in kinds]
    assert table["cluster"].nunique() == 7
    assert len(set(zip(kinds, table["cluster"], strict=True))) == 7


def test_more_subunits_than_can_be_clustered_join_the_nearest_medoid(monkeypatch):
    rng = np.random.default_rng(4)
    all_of_them = traits(rng, 90)
    monkeypatch.setattr(subunits, "LARGEST", 40)
    labels, medoids = subunits._clusters(all_of_them, 8.0)
    assert len(medoids) == 5
    np.testing.assert_array_equal(labels[medoids], np.arange(5))
    chosen = np.unique(np.linspace(0, 89, 40).round().astype(int))
    among = subunits._rows(all_of_them, chosen)
    np.testing.assert_array_equal(labels[chosen], ward.cut(ward.tree(subunits.distances(among, among)), 5).labels)
    nearest = subunits.distances(all_of_them, subunits._rows(all_of_them, medoids)).argmin(axis=1)
    others = np.setdiff1d(np.arange(90), chosen)
    np.testing.assert_array_equal(labels[others], nearest[others])


def test_a_body_that_does_not_move():
    for n_frames in (1, 130):
        for table in subunits.find({"r": skeleton.standing(n_frames, 20.0)}, SETTINGS).values():
            tables.validate(table, "subunits", "subunits")
            assert table["still"].all()
            assert table["cluster"].eq(0).all()
