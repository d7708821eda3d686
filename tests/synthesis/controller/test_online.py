"""The controller as a system: trained on a tiny actor, stored, and driven by speech."""

import numpy as np
import pytest
from vigorous import FPS, FRAME_S, QUICK, Actor, hand_speed

from cospeech.data import tables as files
from cospeech.errors import UserError
from cospeech.motion import library as motion_library
from cospeech.motion import skeleton
from cospeech.synthesis import live
from cospeech.synthesis.controller import SYSTEMS, inference, offline, online, policy, steps, whole
from cospeech.synthesis.controller.library import path_cost
from cospeech.synthesis.controller.model import Segments, matched, with_library
from cospeech.synthesis.controller.semantics import Player, Repetition
from cospeech.synthesis.controller.situations import Weights
from cospeech.synthesis.session import Trained, fault, perform, table_fault

ONLINE, OFFLINE = SYSTEMS


@pytest.fixture(scope="module")
def actor():
    return Actor(1)


@pytest.fixture(scope="module")
def model(actor):
    return online.train(actor.training, QUICK)


def performed(model, speech):
    return perform(ONLINE, Trained(online, model), speech, 0).motion


def steered(model, speech, **controls):
    """The motion of a speech under controls that are set before it starts."""
    state = online.start(model, live.Stream("r", FRAME_S, FPS), 0)
    for name, value in controls.items():
        online.prepare(state, name, value)()
    parts = [online.step(state, heard) for heard in live.frames(speech)]
    return live.motion_table([part for part in [*parts, online.end(state, speech)] if len(part)], FPS)


def test_both_systems_make_motion_of_the_declared_kind(actor, model):
    assert table_fault(ONLINE, online.to_tables(model)) is None
    for system, method in ((ONLINE, online), (OFFLINE, whole)):
        for fps in (20.0, 30.0, 24.0):
            speech = actor.speech(fps=fps)
            made = perform(system, Trained(method, model), speech, 0)
            assert fault(system, made, speech) is None


def test_a_stored_model_is_the_same_model_to_the_last_bit(actor, model, tmp_path):
    keyed = with_library(model, None, {"big": (3, 7), "small": (1,)})
    read = {}
    for name, table in online.to_tables(keyed).items():
        path = tmp_path / f"{name}.parquet"
        files.write(table, path, ONLINE.table_schemas[name], corpus="test", config_hash="x")
        read[name] = files.read(path, ONLINE.table_schemas[name])
    back = online.from_tables(read | {f"motion~{name}": table for name, table in actor.training.motions.items()})
    for name, table in online.to_tables(back).items():
        np.testing.assert_array_equal(table.to_numpy(), online.to_tables(keyed)[name].to_numpy(), err_msg=name)
    speech = actor.speech()
    for controls in ({}, {"style:calm": 0.4}, {"keyword": "big"}):
        assert steered(back, speech, **controls).equals(steered(keyed, speech, **controls))
    cut = keyed.control.cut
    every = slice(0, len(cut.segment))
    np.testing.assert_array_equal(back.control.rows(every), keyed.control.rows(every))


def test_segments_without_their_motion_are_refused_by_name(model):
    with pytest.raises(UserError, match=r"'r0', but not its motion"):
        online.from_tables(online.to_tables(model))


@pytest.mark.parametrize("count", [0, 7])
def test_the_shown_segments_are_those_of_the_policy_under_the_filtered_beliefs(actor, count):
    model = online.train(actor.training, {**QUICK, "repetition_s": 0.0, "situations": count})
    layer, speech = model.control, actor.speech()
    state = online.start(model, live.Stream("r", FRAME_S, FPS), 0)
    shown = []
    for heard in live.frames(speech):
        online.step(state, heard)
        while len(shown) < state.n_steps:
            shown.append(state.shown[:2])
    prosody = steps.prosody(steps.syllables_of(speech.syllables), len(shown), layer.step_s, model.pause_db)
    beliefs = inference.filtered(model.layer, prosody)
    if count:
        apart = np.linalg.norm(beliefs[:, None] - layer.situations.beliefs[None], axis=2)
        beliefs = np.eye(count)[apart.argmin(axis=1)]
    path = policy.play(layer.tones["neutral"].policy, layer.cut, layer.rows, beliefs)
    np.testing.assert_array_equal(shown, np.stack(path, axis=1))


def test_repetition_costs_what_it_says_and_is_forgotten(model):
    """Under the same belief at all times, against a loop that keeps the time at which each segment was entered."""
    layer = model.control
    cut, found = layer.cut, layer.tones["neutral"].policy
    cost, decay = 3.0, 0.97
    player = Player(found, {}, cut, layer.rows, None, Repetition(cost, decay))
    n = len(layer.situations.transitions)
    belief = np.full(n, 1.0 / n)
    entered, shown, piece = {}, [player.step(belief)], 0
    piece = int(cut.first[shown[0].segment])
    entered[shown[0].segment] = 0
    for t in range(1, 300):
        step = player.step(belief)
        if step.decided:
            costs = layer.rows(slice(piece, piece + 1))[0] + found.entering @ belief
            for segment, since in entered.items():
                costs[segment] += cost * decay ** (t - since)
            onward = np.inf if cut.closing[piece] else found.values[piece + 1] @ belief
            if onward <= costs.min():
                piece += 1
            else:
                piece = int(cut.first[int(costs.argmin())])
                entered[int(costs.argmin())] = t
            assert step.segment == cut.segment[piece]
            assert step.frame == cut.begin[piece]
        shown.append(step)
    plain = policy.play(found, cut, layer.rows, np.tile(belief, (300, 1)))
    assert len({step.segment for step in shown}) > len(set(plain.segment))


def test_motion_does_not_depend_on_what_is_heard_later(actor, model):
    own, other = actor.speech(), actor.syllables[actor.new].copy()
    other["intensity_db"] = other["intensity_db"].where(other["known_s"] < 20.0, -20.0)
    one, two = performed(model, own), performed(model, actor.speech(other))
    n_frames = int(20.0 * FPS)
    assert one.iloc[:n_frames].equals(two.iloc[:n_frames])
    assert not one.equals(two)


def test_hands_follow_the_loudness_of_new_speech():
    correlations = []
    for seed in (2, 3):
        actor = Actor(seed, records=4, duration_s=60.0)
        model = online.train(actor.training, QUICK)
        levels, n = actor.levels[actor.new], 20
        own = np.corrcoef(np.convolve(hand_speed(performed(model, actor.speech())), np.ones(n) / n, "same"), levels)
        shifted = []
        for shift_s in (15.0, 30.0, 45.0):
            table = actor.syllables[actor.new].copy()
            times = ["start_s", "peak_s", "end_s", "known_s"]
            table[times] += shift_s
            table.loc[table["known_s"] > 60.0, times] -= 60.0
            speed = hand_speed(performed(model, actor.speech(table.sort_values("known_s"))))
            shifted.append(np.corrcoef(np.convolve(speed, np.ones(n) / n, "same"), levels)[0, 1])
        correlations.append((own[0, 1], np.mean(shifted)))
    own, shifted = np.mean(correlations, axis=0)
    assert own > shifted + 0.25


def test_styles_change_the_speed_of_the_hands(actor, model):
    speech = actor.speech()
    speeds = [
        hand_speed(steered(model, speech, **controls)).mean()
        for controls in ({"style:calm": 1.0}, {}, {"style:energetic": 0.5}, {"style:energetic": 1.0})
    ]
    assert speeds[0] < speeds[1] < speeds[3]
    assert speeds[2] > speeds[1]
    assert steered(model, speech, **{"style:calm": 0.0}).equals(performed(model, speech))


def test_degrees_beyond_one_share_it(model):
    half = online.in_style(model.control, {"energetic": 0.5, "calm": 0.5})
    both = online.in_style(model.control, {"energetic": 1.0, "calm": 1.0})
    np.testing.assert_allclose(half.distances, both.distances)
    tones = model.control.tones
    expected = 0.5 * (tones["energetic"].distances + tones["calm"].distances)
    np.testing.assert_allclose(half.distances, expected)


def test_a_keyword_is_followed_by_one_of_its_segments_at_the_end_of_a_piece(actor, model):
    keyed = with_library(model, None, {"big": (3, 7)})
    longest = keyed.control.cut.length.max()
    state = online.start(keyed, live.Stream("r", FRAME_S, FPS), 0)
    shown, called = [], 0
    for heard in live.frames(actor.speech()):
        if heard.frame == 600:
            online.prepare(state, "keyword", "big")()
            called = state.n_steps
        online.step(state, heard)
        while len(shown) < state.n_steps:
            shown.append(state.shown.segment)
    assert {3, 7} & set(shown[called : called + longest + 1])


WRONG = {
    ("style:angry", 1.0): r"no style 'angry'; its styles: energetic, calm",
    ("style:calm", 1.5): r"'calm': 1.5 is not a degree",
    ("style:calm", float("nan")): r"'calm': nan is not a degree",
    ("keyword", "big"): r"'big' has no segment .*; add some with 'cospeech library --keywords'",
    ("speed", 1.0): r"'speed' cannot be controlled; known are keyword and style:",
}


@pytest.mark.parametrize(("name", "value"), WRONG)
def test_what_cannot_be_controlled_is_named_with_what_can(model, name, value):
    state = online.start(model, live.Stream("r", FRAME_S, FPS), 0)
    with pytest.raises(UserError, match=WRONG[name, value]):
        online.prepare(state, name, value)()


@pytest.mark.parametrize("chosen", [(), (100_000,), (-1,)])
def test_keywords_need_segments_of_the_library(model, chosen):
    with pytest.raises(UserError, match=r"keyword 'big' has .* numbered 0 to "):
        with_library(model, None, {"big": chosen})


def test_the_offline_controller_finds_a_path_that_costs_less(actor, model):
    layer, speech = model.control, actor.speech()
    prosody = whole.prosody(model, speech, 400)
    smoothed, delta = inference.smoothed(model.layer, prosody), layer.tones["neutral"].distances
    made = whole.synthesise(model, speech, 0)
    weights = Weights(layer.situations).of_each(inference.filtered(model.layer, prosody))
    played = policy.play(layer.tones["neutral"].policy, layer.cut, layer.rows, weights)
    best = offline.animate(layer.cut, layer.rows, delta, smoothed)
    assert made.decoding["log_score"].iloc[0] == -best.cost
    assert best.cost < path_cost(played, layer.cut, layer.rows, delta, smoothed)


def test_an_actor_with_little_motion_has_no_style():
    actor = Actor(4, records=2, duration_s=6.0)
    model = online.train(actor.training, {**QUICK, "states": [2], "clusters": 2})
    assert list(model.control.tones) == ["neutral"]
    state = online.start(model, live.Stream("r", FRAME_S, FPS), 0)
    with pytest.raises(UserError, match="none, as it was trained on too little motion"):
        online.prepare(state, "style:calm", 1.0)


def test_a_recording_that_is_shown_as_it_is_stays_as_it_is(actor, model):
    """Segments of one recording, one after another, are the recording: nothing is lost or blended at their joins."""
    layer = model.control
    own = layer.library.table
    rows = np.flatnonzero(own["record"] == "r0")
    for fps in (FPS, 30.0):
        screen = online.Screen(layer, fps)
        lengths = (layer.library.end - layer.library.start)[rows] // layer.per_step
        path = [(a, f) for a, n in zip(rows, lengths, strict=True) for f in range(n)]
        made = []
        while screen.step < len(path):
            made.append(screen.next(*path[screen.step]))
        shown = motion_library.Poses.from_frames(np.array(made))
        recorded = motion_library.from_motion(actor.motions["r0"])
        if fps != FPS:
            times = (np.arange(len(made)) + 0.5) / fps * FPS - 0.5
            recorded = recorded.resampled(np.clip(times, 0, len(recorded.root_m) - 1))
        same = np.abs((shown.rotations * recorded.rotations[: len(made)]).sum(axis=2))
        assert same.min() > 1.0 - 1e-9
        np.testing.assert_allclose(shown.root_m, recorded.root_m[: len(made)], atol=1e-9)
    assert skeleton.frame_rate(actor.motions["r0"]) == FPS


def test_the_kinematics_of_another_body_get_the_range_of_the_training_records(model):
    own, layer = model.control, model.layer
    rng = np.random.default_rng(7)
    found = Segments(own.library, own.per_step, 3.0 + 0.2 * rng.normal(size=own.kinematics.shape))
    y = layer.kinematics.apply(matched(layer, found).kinematics)
    lengths = own.library.end - own.library.start
    np.testing.assert_allclose(np.average(y, axis=0, weights=lengths), 0.0, atol=1e-9)
    np.testing.assert_allclose(np.average(y**2, axis=0, weights=lengths), 1.0)
    np.testing.assert_array_equal(np.argsort(y[:, 2]), np.argsort(found.kinematics[:, 2]))
    constant = matched(layer, found._replace(kinematics=np.ones_like(own.kinematics)))
    np.testing.assert_allclose(constant.kinematics, np.tile(layer.kinematics.mean, (len(y), 1)))
