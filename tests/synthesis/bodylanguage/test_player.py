"""Body language as it is heard: what is selected, when, and that nothing depends on what is not known yet."""

from dataclasses import replace

import numpy as np
import pytest
import speaking_body
from scipy.spatial.transform import Rotation
from speaking_body import FPS, FRAME_S, SETTINGS

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.motion.body import STANDARD
from cospeech.synthesis import live
from cospeech.synthesis.bodylanguage import (
    SYSTEMS,
    forward,
    model,
    player_kernels,
    proposed,
    random_selection,
    random_synchronised,
    unsynchronised,
)
from cospeech.synthesis.live import Stream

METHODS = (proposed, random_selection, random_synchronised, unsynchronised)
SEED = 2012


def synthesise(method, trained, speech, seed=SEED):
    return live.by_steps(method, "motion", trained, speech, seed).motion


def watched(method, trained, speech, seed=SEED):
    """The player, and per prosody frame: how many observations it got, the segments and frames shown, the belief."""
    player = method.start(trained, Stream("new", FRAME_S, speech.motion_fps), seed)
    seen = []
    hear = player.listener.hear
    player.listener.hear = lambda *heard: seen.append(hear(*heard)) or seen[-1]
    rows = []
    for heard in live.frames(speech):
        method.step(player, heard)
        rows.append((player.memory.segment.copy(), player.memory.frame.copy(), player.memory.started.copy()))
    return player, seen, rows


@pytest.mark.parametrize("method", METHODS)
def test_motion_covers_the_record_and_depends_on_the_seed_alone(trained, method):
    for fps in (FPS, 60.0):
        speech = speaking_body.speech(fps=fps)
        made = synthesise(method, trained, speech)
        tables.validate(made, "motion", "motion")
        assert len(made) == speech.n_motion_frames
        assert made.equals(synthesise(method, trained, speech))
        assert not made.equals(synthesise(method, trained, speech, seed=1))


def test_nothing_depends_on_speech_that_is_not_known_yet(trained):
    speech = speaking_body.speech()
    whole = synthesise(proposed, trained, speech)
    for until_s in (3.0, 9.3):
        known = speech.syllables[speech.syllables["known_s"] <= until_s]
        cut = synthesise(proposed, trained, replace(speech, syllables=known))
        n_same = int(until_s * FPS)
        assert whole[:n_same].equals(cut[:n_same])
        assert not whole.equals(cut)


def in_world(rotations, joint):
    """The rotation of a joint in world space, given the poses of all in parent space, w first (J, 4)."""
    turned = Rotation.identity()
    while joint >= 0:
        turned, joint = Rotation.from_quat(rotations[joint], scalar_first=True) * turned, STANDARD.parents[joint]
    return turned


def test_a_section_is_inclined_as_in_its_recording_and_turns_with_the_hips():
    rng = np.random.default_rng(5)
    parents = np.asarray(STANDARD.parents, dtype=np.int64)
    for _ in range(20):
        source, desired = Rotation.random(2 * len(parents), rng=rng).as_quat(scalar_first=True).reshape(2, -1, 4)
        before = desired.copy()
        joint = STANDARD.joints.index("spine")
        player_kernels.keep_upright(parents, source, joint, desired, np.empty((3, 4)))
        np.testing.assert_array_equal(np.delete(desired, joint, axis=0), np.delete(before, joint, axis=0))
        apart = in_world(desired, joint) * in_world(source, joint).inv()
        np.testing.assert_allclose(apart.apply([0.0, 1.0, 0.0]), [0.0, 1.0, 0.0], atol=1e-12)
        turned = Rotation.from_rotvec([0.0, rng.uniform(-3.0, 3.0), 0.0])
        same = source.copy()
        same[0] = (turned * Rotation.from_quat(source[0], scalar_first=True)).as_quat(scalar_first=True)
        player_kernels.keep_upright(parents, source, joint, same, np.empty((3, 4)))
        np.testing.assert_allclose(np.abs((same[joint] * source[joint]).sum()), 1.0, atol=1e-12)


def test_what_is_shown_of_every_section_is_inclined_as_in_its_recording(trained):
    player = proposed.start(trained, Stream("new", FRAME_S, FPS), SEED)
    sections, n_checked = player.sections, 0
    for heard in live.frames(speaking_body.speech()):
        if len(player.hear(heard)) != 1:
            continue
        shown = sections.begin[player.memory.segment] + player.memory.frame - 1
        for name, s in (("spine", 1), ("neck", 0)):
            joint = STANDARD.joints.index(name)
            apart = in_world(player._desired[0, 3:].reshape(-1, 4), joint)
            apart *= in_world(sections.rotations[shown[s]], joint).inv()
            np.testing.assert_allclose(apart.apply([0.0, 1.0, 0.0]), [0.0, 1.0, 0.0], atol=1e-9)
            n_checked += 1
    assert n_checked > 100


def changes(rows):
    """Per section, the prosody frames at which another subunit is shown, or the same one from its start."""
    segment, frame, _ = (np.array(column) for column in zip(*rows, strict=True))
    return (np.diff(segment, axis=0) != 0) | (np.diff(frame, axis=0) < 0)


@pytest.mark.parametrize("method", METHODS)
def test_subunits_are_interrupted_at_observations_only_and_by_synchronised_systems_only(trained, method):
    player, seen, rows = watched(method, trained, speaking_body.speech())
    interrupts = {proposed: True, random_synchronised: True, random_selection: False, unsynchronised: False}[method]
    interrupted = 0
    for k, changed in enumerate(changes(rows)):
        for s in np.flatnonzero(changed):
            before, shown = rows[k][0][s], rows[k][1][s]
            if shown < player.sections.n_frames[before]:
                assert len(seen[k + 1]) > 0
                interrupted += 1
    assert (interrupted > 0) == interrupts


def test_beliefs_are_those_of_the_observations_alone(trained):
    """Whatever is shown, unless a subunit ends unexpectedly: here, none does, since all are very long."""
    speech = speaking_body.speech()
    player = proposed.start(trained, Stream("new", FRAME_S, FPS), SEED)
    player.sections.n_frames[:] = 10**6
    chain = trained.chains["arms"]
    belief = forward.first(chain.initial, forward.EXACT)
    time_s = 0.0
    listener = proposed.start(trained, Stream("new", FRAME_S, FPS), SEED).listener
    for heard in live.frames(speech):
        player.memory.frame[:] = 0
        player.hear(heard)
        for one in listener.hear((heard.frame + 1) * FRAME_S, heard.syllables):
            new = forward.empty(len(chain.initial), forward.EXACT)
            forward.update(
                chain.continuing, forward.successors(chain.after_start, chain.after),
                chain.emissions[one.observation], chain.logit, chain.length_s, one.known_s - time_s,
                np.zeros(len(chain.initial), dtype=bool), forward.EXACT, belief, new,
            )  # fmt: skip
            belief, time_s = new, one.known_s
    shown = player.beliefs.start[player.memory.now[0], 1, : len(chain.initial)]
    np.testing.assert_allclose(shown, belief.start, atol=1e-12)


def test_a_subunit_that_is_over_is_not_believed_to_continue(trained):
    player = proposed.start(trained, Stream("new", FRAME_S, FPS), SEED)
    speech = speaking_body.speech()
    ended = 0
    for heard in live.frames(speech):
        before = player.memory.segment.copy()
        player.hear(heard)
        for s in range(3):
            over = player.memory.ended[s]
            if over.any():
                cluster = player.sections.cluster[before[s]]
                ended += over[cluster]
                at = player.memory.now[0], s
                for cluster in np.flatnonzero(over):
                    assert forward.carried(player.beliefs.entry[at], player.beliefs.n_entries[at], cluster) == 0.0
    assert ended > 10


def test_a_subunit_of_a_similar_first_pose_is_selected_and_all_similar_ones_alike(trained):
    player = proposed.start(trained, Stream("new", FRAME_S, FPS), SEED)
    sections, memory, rng = player.sections, player.memory, np.random.default_rng(3)
    for trial in range(20):
        s = trial % 3
        cluster = rng.integers(4)
        members = sections.members[sections.first[s, cluster] : sections.first[s, cluster + 1]]
        pose = np.append(np.zeros(3), sections.rotations[rng.integers(len(sections.rotations))])
        joints = sections.joints[s] == 1
        cosine = np.abs((sections.rotations[sections.begin[members]] * pose[3:].reshape(-1, 4)).sum(axis=2))[
            :, joints
        ]
        distances = np.sqrt((4.0 * np.arccos(np.minimum(cosine, 1.0)) ** 2).mean(axis=1))
        near = members[distances <= distances.min() + np.radians(20.0) + 1e-12]
        memory.uniforms[:600] = (np.arange(600) + 0.5) / 600
        memory.used[0] = 0
        chosen = [player_kernels._similar(members, sections, memory, s, pose, np.radians(20.0)) for _ in range(600)]
        counts = {int(member): chosen.count(member) for member in set(chosen)}
        assert sorted(counts) == sorted(near)
        assert max(counts.values()) - min(counts.values()) <= 1


def test_a_model_survives_its_tables_and_synthesises_the_same(training, trained, tmp_path):
    found = model.to_tables(trained)
    declared = SYSTEMS[0].table_schemas
    assert set(found) == set(declared)
    read = {}
    for name, table in found.items():
        tables.write(table, tmp_path / f"{name}.parquet", declared[name], corpus="virtual", config_hash="0")
        read[name] = tables.read(tmp_path / f"{name}.parquet", declared[name])
    again = model.from_tables(read | {f"motion~{record}": table for record, table in training.motions.items()})
    for name, table in model.to_tables(again).items():
        assert table.equals(read[name]), name
    speech = speaking_body.speech()
    assert synthesise(proposed, again, speech).equals(synthesise(proposed, trained, speech))


def test_what_is_missing_is_named(training, trained):
    with pytest.raises(UserError, match="elapsed: 'sometimes' is unknown; use exact, expected, printed"):
        model.train(training, SETTINGS | {"elapsed": "sometimes"})
    with pytest.raises(UserError, match="blending: 'none' is unknown; use velocity, smooth"):
        model.train(training, SETTINGS | {"blending": "none"})
    with pytest.raises(UserError, match="pose_tolerance_deg must not be negative"):
        model.train(training, SETTINGS | {"pose_tolerance_deg": -1.0})
    with pytest.raises(UserError, match="actor ada: no training record has gesture subunits"):
        model.train(replace(training, subunits={}), SETTINGS)
    found = model.to_tables(trained)
    with pytest.raises(UserError, match="the motion library has segments of 'r0', but no motion of it"):
        model.from_tables(found)
    damaged = found | {"successors": found["successors"].iloc[1:]}
    with pytest.raises(UserError, match="tables of the section 'head' do not fit together"):
        model.from_tables(damaged)


def test_silent_speech_and_a_record_without_syllables_go_through(training):
    silent = speaking_body.speech()
    silent = replace(silent, syllables=silent.syllables.iloc[:0])
    without = replace(training, syllables={name: table.iloc[:0] for name, table in training.syllables.items()})
    for one in (training, without):
        made = synthesise(proposed, model.train(one, SETTINGS), silent)
        assert len(made) == silent.n_motion_frames
        assert np.isfinite(made.to_numpy(dtype=float)).all()


def test_every_mode_synthesises(training):
    speech = speaking_body.speech()
    made = [
        synthesise(proposed, model.train(training, SETTINGS | {"elapsed": mode}), speech) for mode in forward.MODES
    ]
    assert not made[0].equals(made[2])
