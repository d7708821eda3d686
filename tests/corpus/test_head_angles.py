"""Angles of heads from files of other programs: what must be declared, and that conventions mean one rotation."""

import itertools

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from cospeech.corpus import head_angles
from cospeech.corpus.head_angles import HeadConventions
from cospeech.data import segments, tables
from cospeech.errors import UserError
from cospeech.motion import head

COLUMNS = {"time": "time_s", "x": "x_deg", "y": "y_deg", "z": "z_deg"}
OURS = HeadConventions("XYZ", "deg", "y", "z", COLUMNS)
CAMERA = HeadConventions(
    "XYZ", "rad", "-y", "-z", {"time": "timestamp", "x": "pose_Rx", "y": "pose_Ry", "z": "pose_Rz"}
)


def planted(n_frames=40, seed=0):
    return np.random.default_rng(seed).uniform(-35.0, 35.0, (n_frames, 3))


def write(path, angles, conventions=OURS, fps=25.0):
    named = {conventions.columns["time"]: segments.frame_times(len(angles), fps)}
    named |= {conventions.columns[axis]: angles[:, place] for place, axis in enumerate("xyz")}
    pd.DataFrame(named | {"confidence": 0.9}).to_csv(path, index=False)
    return path


ORDERS = ["".join(order) for order in itertools.permutations("XYZ")]


@pytest.mark.parametrize("order", [*ORDERS, *map(str.lower, ORDERS)])
def test_every_order_describes_the_same_rotations(tmp_path, order):
    turned = Rotation.from_euler("XYZ", planted(), degrees=True)
    given = turned.as_euler(order, degrees=True)
    by_axis = np.column_stack([given[:, order.upper().index(axis)] for axis in "XYZ"])
    conventions = HeadConventions(order, "deg", "y", "z", COLUMNS)
    found = head_angles.read(write(tmp_path / "a.csv", by_axis), "a", conventions)
    np.testing.assert_allclose(found[head.COLUMNS], planted(), atol=1e-9)
    tables.validate(found, "head", "a")
    assert head.frame_rate(found) == 25.0


def test_axes_of_a_camera_that_looks_at_the_face_become_ours(tmp_path):
    """In a camera's axes (x to the right of the image, y down, z away), a nod down is a rotation about +x."""
    for place, sign in enumerate((1.0, -1.0, -1.0)):
        seen = np.zeros((30, 3))
        seen[10:, place] = np.radians(20.0)
        found = head_angles.read(write(tmp_path / "a.csv", seen, CAMERA), "a", CAMERA)
        expected = np.zeros(3)
        expected[place] = sign * 20.0
        np.testing.assert_allclose(found[head.COLUMNS].to_numpy()[20], expected, atol=1e-9)


def test_frames_without_a_face_have_no_angles(tmp_path):
    angles = planted()
    angles[7, 1] = np.nan
    found = head_angles.read(write(tmp_path / "a.csv", angles), "a", OURS)
    assert found[head.COLUMNS].isna().all(axis=1).tolist() == [frame == 7 for frame in range(40)]


def test_our_own_tables_declare_themselves(tmp_path):
    path = tmp_path / "a.parquet"
    tables.write(head.table(planted(), 30.0), path, "head", corpus="x", config_hash="x")
    found = head_angles.read(path, "a", HeadConventions(None, None, "y", "z", COLUMNS))
    np.testing.assert_allclose(found[head.COLUMNS], planted())


@pytest.mark.parametrize(
    ("conventions", "change", "complaint"),
    [
        ({"order": None}, {}, r"record 'r': .*its angles come without their order; declare corpus\.head\.order"),
        (
            {"order": None, "unit": None},
            {},
            r"without their order and unit; declare corpus\.head\.order and corpus\.head\.unit",
        ),
        (
            {"columns": COLUMNS | {"y": "yaw"}},
            {},
            r"column 'yaw' is missing; name its columns in corpus\.head\.columns",
        ),
        ({"unit": "rad"}, {}, r"an angle of \d+\.?\d* is not in radians; set corpus\.head\.unit to deg"),
        ({}, {"scale": 0.01}, r"seem to be in radians; set corpus\.head\.unit to rad"),
        ({}, {"scale": np.nan}, "no frame has angles"),
        ({}, {"cut": 3}, "frames are missing or not uniform"),
        ({"facing": "-y"}, {}, r"corpus\.head: up is 'y' and facing is '-y'"),
    ],
)
def test_what_is_undeclared_or_contradicted_is_refused_in_one_line(tmp_path, conventions, change, complaint):
    path = write(tmp_path / "a.csv", planted() * change.get("scale", 1.0))
    if "cut" in change:
        pd.read_csv(path).drop(index=change["cut"]).to_csv(path, index=False)
    declared = {name: getattr(OURS, name) for name in ("order", "unit", "up", "facing", "columns")} | conventions
    with pytest.raises(UserError, match=complaint) as caught:
        head_angles.read(path, "r", HeadConventions(**declared))
    assert "\n" not in str(caught.value)
