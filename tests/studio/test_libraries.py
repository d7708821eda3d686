"""Motion libraries: each situation is recognisable in the motion, and the creature has eight limbs that move."""

import numpy as np
import pytest

from cospeech.data import tables
from cospeech.formats import bvh
from cospeech.motion import skeleton
from cospeech.studio import creature, libraries

FPS, SEED = 20.0, 2012


@pytest.fixture(scope="module")
def found():
    """Joint positions of two minutes of each situation, relative to the floor below the actor."""
    moved = {name: libraries.perform(name, f"{name}_1", 120.0, FPS, SEED) for name in libraries.SITUATIONS}
    for name, table in moved.items():
        tables.validate(table, "motion", name)
        assert len(table) == 2400
    return {
        name: skeleton.forward(table[list(skeleton.ROOT_COLUMNS)].to_numpy(), skeleton.angles(table))
        for name, table in moved.items()
    }


@pytest.mark.parametrize("total_s", [10.0, 51.0, 60.0, 61.0, 706.0, 190.5])
def test_recordings_last_as_long_as_the_library_in_all(total_s):
    lengths = libraries.durations_s(total_s)
    assert sum(lengths) == pytest.approx(total_s)
    assert max(lengths) <= libraries.LONGEST_S + 0.5
    assert max(lengths) - min(lengths) <= 1.5
    assert all(length == round(length) for length in lengths[:-1])


@pytest.mark.parametrize("name", libraries.SITUATIONS)
def test_feet_stay_flat_on_the_floor_and_nothing_is_below_it(found, name):
    for side in ("left", "right"):
        foot = found[name][f"{side}_foot"]
        assert np.ptp(foot, axis=0).max() < 2e-3
        assert foot[:, 1].mean() == pytest.approx(0.07, abs=1e-3)
    assert min(places[:, 1].min() for places in found[name].values()) > 0.0


@pytest.mark.parametrize("name", ["seated", "fork"])
def test_who_sits_has_the_hips_at_the_height_of_the_knees(found, name):
    hips, knee, foot = (found[name][joint] for joint in ("hips", "left_shin", "left_foot"))
    assert np.abs(hips[:, 1] - knee[:, 1]).max() < 0.08
    assert (foot[:, 2] - hips[:, 2]).min() > 0.35
    assert found[name]["left_hand"][:, 1].min() > 0.5  # on the thigh, not below the seat


def distance(found, one, other):
    return np.linalg.norm(found[one] - found[other], axis=1)


def test_the_hand_that_holds_something_is_where_it_belongs(found):
    assert distance(found["phone"], "right_hand", "head").max() < 0.25
    for name, share in (("mug", 0.02), ("fork", 0.1)):
        near = distance(found[name], "right_hand", "head")
        assert (near < 0.22).mean() > share
        assert (near > 0.35).mean() > 0.3
    still = [np.ptp(found[name]["right_hand"], axis=0).max() for name in ("phone", "standard")]
    assert still[0] < 0.15 < 0.5 < still[1]


@pytest.mark.parametrize("name", libraries.SITUATIONS)
def test_a_free_hand_gestures(found, name):
    assert np.ptp(found[name]["left_hand"], axis=0).max() > 0.3


def test_a_recording_is_reproducible_and_differs_from_others():
    one, again, other = (libraries.perform("mug", name, 20.0, FPS, SEED) for name in ("a", "a", "b"))
    assert one.equals(again)
    assert not one.equals(other)


def test_the_creature_has_eight_limbs_that_move_and_rest(tmp_path):
    clip = creature.perform("creature_1", 51.0, FPS, SEED)
    bvh.write_clip(clip, tmp_path / "creature.bvh")
    read = bvh.read(tmp_path / "creature.bvh")
    assert len(read.rotations) == 1020
    assert not read.notes
    for index, name in enumerate(read.names):
        own = clip.names.index(name)
        np.testing.assert_allclose(read.rotations[:, index], clip.rotations[:, own], atol=1e-6)
        np.testing.assert_allclose(read.offsets[index], clip.offsets[own] if own else 0.0, atol=1e-6)
        assert (read.names[read.parents[index]] if index else None) == (
            clip.names[clip.parents[own]] if own else None
        )
    np.testing.assert_allclose(read.places[0], clip.places[0], atol=1e-6)
    np.testing.assert_array_equal(clip.rotations, creature.perform("creature_1", 51.0, FPS, SEED).rotations)
    tips = limb_tips(clip)
    assert tips.shape == (1020, 8, 3)
    speed = np.linalg.norm(np.gradient(tips, 1.0 / FPS, axis=0), axis=2)
    assert (speed.max(axis=0) > 0.5).all()
    resting = (speed.mean(axis=1) < 0.15).mean()
    assert 0.1 < resting < 0.9
    assert tips[:, :, 1].min() > 0.0


def limb_tips(clip):
    """Return the positions of the tips of the limbs, (T, L, 3), joint after joint."""
    turned, placed = [], []
    for index, parent in enumerate(clip.parents):
        own = clip.rotations[:, index]
        turned.append(own if parent < 0 else turned[parent] @ own)
        placed.append(clip.places[0] if parent < 0 else placed[parent] + turned[parent] @ clip.offsets[index])
    limbs = [joint for joint in clip.tips if clip.names[joint].startswith("limb")]
    return np.stack([placed[joint] + turned[joint] @ clip.tips[joint] for joint in limbs], axis=1)


def test_a_clip_whose_joints_leave_their_offsets_is_not_written(tmp_path):
    clip = creature.perform("x", 10.0, FPS, SEED)
    clip.places[1] = clip.places[0]
    with pytest.raises(ValueError, match="no BVH hierarchy"):
        bvh.write_clip(clip, tmp_path / "x.bvh")
