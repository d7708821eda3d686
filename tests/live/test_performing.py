"""Systems that decode again at every hop: motion of their phrases, which never changes what was shown."""

import numpy as np
import pandas as pd
import pytest
from stand_in import Chunks, run

from cospeech import api
from cospeech.errors import UserError
from cospeech.geometry import rotation
from cospeech.live import engine, performing
from cospeech.live import hearing as hearing_module
from cospeech.live.phrases import JOINTS, Player
from cospeech.motion import library, skeleton
from cospeech.synthesis.declaration import System
from cospeech.synthesis.session import Trained


@pytest.fixture(scope="module")
def bundled():
    return api.load_model()


def arms(frames):
    return rotation.from_quaternions(frames[:, 3:].reshape(len(frames), 17, 4)[:, JOINTS])


def steps_deg(frames):
    """The largest angle by which an arm or hand turns between consecutive frames, (n - 1,)."""
    turned = arms(frames)
    return rotation.angles_deg(np.swapaxes(turned[:-1], -1, -2) @ turned[1:]).max(axis=1)


def test_the_hsmm_gestures_live_and_never_changes_what_it_has_shown(bundled, samples):
    _, whole = run(bundled, Chunks(samples, 400))
    assert len(whole) == 250
    for length, size in ((40_000, 400), (100_000, 7777)):  # nor does it depend on the chunks
        _, begun = run(bundled, Chunks(samples[:length], size))
        np.testing.assert_array_equal(begun, whole[: len(begun)])
    assert steps_deg(whole).max() > 1.0
    recorded = [library.from_motion(motion).frames for motion in bundled.motions.values()]
    assert steps_deg(whole).max() < max(steps_deg(motion).max() for motion in recorded) + 90 / 10 * 1.5


def test_nothing_moves_before_anybody_speaks(bundled):
    _, frames = run(bundled, Chunks(np.zeros(32_000), 400))
    assert len(frames) == 50
    np.testing.assert_array_equal(frames, np.tile(library.from_motion(skeleton.standing(1, 25.0)).frames, (50, 1)))


class Planner:
    """Plans what it is told: phrases by the number of prosody frames heard."""

    def __init__(self, phrases):
        self.phrases, self.lengths = phrases, []

    def synthesise(self, model, speech, seed):
        from cospeech.synthesis.interface import Synthesis, decoding, phrases_of

        self.lengths.append(speech.n_frames)
        return Synthesis(decoding(speech), phrases_of(speech, [0], [self.phrases(speech.n_frames)]))


def planning(bundled, phrases, **declared):
    system = System(name="plans", title="Plans", method="cospeech.synthesis.plans", **declared)
    return bundled._replace(system=system, trained=Trained(Planner(phrases), None))


def test_it_decodes_recent_speech_at_every_hop_and_shows_the_class_of_the_last_phrase(bundled, samples, monkeypatch):
    monkeypatch.setattr(hearing_module, "RECENT_S", 7.5)
    model = planning(bundled, lambda n: "left" if n > 200 else "right")
    hearing = engine.listening(model, 16000)
    made = performing.performer(model, hearing, 0)
    played = []
    made._player.play = played.append
    ends = []
    for heard in hearing.push(samples):
        made.step(heard)
        ends += [(heard.frame, label) for label in played[len(ends) :]]
    lengths = model.trained.method.lengths
    first = lengths[0]
    heard = [first, *(n for n in range(first + 40, 400, 10) if not 210 < n < 250)]
    assert lengths == [min(n, 300) for n in heard]
    assert ends == [(first - 1, "right"), (209, "left")]


def test_phrases_of_a_system_that_decodes_again_last_at_least_a_second(bundled, samples):
    model = planning(bundled, lambda n: "left" if n % 20 else "right")
    hearing = engine.listening(model, 16000)
    made = performing.performer(model, hearing, 0)
    starts = []
    made._player.play = lambda label: starts.append(hearing.recent.n_heard)
    for heard in hearing.push(samples):
        made.step(heard)
    assert len(starts) > 2
    assert min(np.diff(starts)) >= 40


def test_systems_that_cannot_run_live_are_refused(bundled):
    for declared in ({"needs": ("prosody_labels", "truth")}, {"needs": ("prosody",), "makes": "motion"}):
        model = planning(bundled, lambda n: "left", **declared)
        with pytest.raises(UserError, match="'plans' of this model needs the whole recording and cannot run live"):
            performing.performer(model, engine.listening(model, 16000), 0)


def test_a_system_without_styles_says_so(bundled):
    made = performing.performer(bundled, engine.listening(bundled, 16000), 0)
    with pytest.raises(UserError, match="'hsmm_sampled' of this model has no styles and no keywords"):
        made.prepare("style:energetic", 0.5)


class Lift:
    """A live system that returns motion tables and listens to prosody and labels."""

    def start(self, model, stream, seed):
        return {"n": 0, "fps": stream.motion_fps, "heard": []}

    def step(self, state, heard):
        state["heard"].append((heard.label, heard.features["time_s"], heard.features["intensity"]))
        motion = skeleton.standing(int((heard.frame + 1) * 0.025 * state["fps"] + 0.5) - state["n"], state["fps"])
        motion["left_arm_z_deg"] = 45.0
        state["n"] += len(motion)
        return motion

    def end(self, state, speech):
        return skeleton.standing(speech.n_motion_frames - state["n"], state["fps"])


class Turns(Lift):
    """A live system that makes phrases."""

    def step(self, state, heard):
        super().step(state, heard)
        return [(heard.frame, "left")] if heard.frame == 100 else []

    def end(self, state, speech):
        return []


def live_model(bundled, method, makes):
    system = System(
        name="live", title="Live", method="cospeech.synthesis.live", needs=("prosody", "prosody_labels"),
        makes=makes, live=True,
    )  # fmt: skip
    return bundled._replace(system=system, trained=Trained(method, None))


def test_a_live_system_may_return_tables_and_hears_prosody(bundled, samples):
    model = live_model(bundled, Lift(), "motion")
    hearing = engine.listening(model, 16000)
    made = performing.performer(model, hearing, 0)
    frames = np.concatenate([made.step(heard) for heard in hearing.push(samples[:40_000])])
    assert frames.shape[1] == 71
    turned = rotation.from_quaternions(frames[:, 3:].reshape(-1, 17, 4))[:, skeleton.JOINTS.index("left_arm")]
    np.testing.assert_allclose(skeleton.euler(turned), np.tile([0.0, 0.0, 45.0], (len(frames), 1)), atol=1e-9)
    labels, times_s, intensities = zip(*made._steps._state["heard"], strict=True)
    np.testing.assert_allclose(times_s, (np.arange(len(times_s)) + 0.5) * 0.025)
    assert labels[0] == ""
    assert set(labels[-10:]) <= set(bundled.prosody_model.labels)
    assert np.std(intensities[-40:]) > 0.1


def test_a_live_system_may_make_phrases(bundled, samples):
    _, frames = run(live_model(bundled, Turns(), "phrases"), Chunks(samples[:48_000], 400))
    assert len(frames) == 75
    assert steps_deg(frames)[:62].max() == 0.0
    assert steps_deg(frames)[62:].max() > 0.5


@pytest.fixture
def library_of_two():
    """Ten frames of a raised left arm (class up), then twenty of hanging arms (class down), at 25 per second."""
    motion = skeleton.standing(30, 25.0)
    motion.loc[:9, "left_arm_z_deg"] = np.linspace(60.0, 69.0, 10)
    gestures = pd.DataFrame(
        {
            "record": "r", "segment": [0, 1], "label": ["up", "down"], "start_frame": [0, 16], "end_frame": [16, 48],
            "start_s": [0.0, 0.4], "end_s": [0.4, 1.2],
        }
    )  # fmt: skip
    return gestures, {"r": motion}


def test_gestures_are_joined_without_a_jump_repeated_and_cut(library_of_two):
    player = Player(*library_of_two, 25.0)
    frames = [player.frame() for _ in range(5)]
    player.play("up")
    frames += [player.frame() for _ in range(25)]
    player.play("down")
    frames += [player.frame() for _ in range(30)]
    left = skeleton.euler(arms(np.array(frames)))[:, 0]
    assert (left[:5] == 0).all()
    assert np.abs(np.diff(left[:, 2])).max() < 60 / 10 * 1.5 + 2  # the steepest slope of the join, and of the gesture
    assert 60 < left[29, 2] < 70  # repeated since the end of the gesture
    assert left[-1, 2] == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(left[14, 2], 69.0, atol=1e-9)


def test_the_pose_is_held_where_no_gesture_of_the_class_was_recorded(library_of_two):
    player = Player(*library_of_two, 25.0)
    player.play("up")
    shown = [player.frame() for _ in range(8)]
    player.play("perpendicular")
    for _ in range(50):
        np.testing.assert_array_equal(player.frame(), shown[-1])


def test_gestures_are_resampled_to_the_rate_of_the_motion(library_of_two):
    player = Player(*library_of_two, 50.0)
    player.play("down")
    player.play("up")
    left = skeleton.euler(arms(np.array([player.frame() for _ in range(20)])))[:, 0, 2]
    assert left[-2] == pytest.approx(68.75, abs=0.5)  # at 8.75 of the ten frames, where the join is nearly over
