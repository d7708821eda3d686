"""The material of the controller's exhibits, on a tiny actor."""

import numpy as np
import pytest
from vigorous import QUICK, Actor

from cospeech.motion import skeleton
from cospeech.synthesis.controller import SYSTEMS, control, inference, online, policy, report, whole
from cospeech.synthesis.controller.library import path_cost
from cospeech.synthesis.controller.situations import Weights
from cospeech.synthesis.session import Trained, perform

OFFLINE = SYSTEMS[1]


@pytest.fixture(scope="module")
def actor():
    return Actor(5, records=4, duration_s=30.0)


@pytest.fixture(scope="module")
def model(actor):
    return whole.train(actor.training, {**QUICK, "repetition_s": 0.0})


def test_every_held_out_record_is_scored_for_every_window(actor, model):
    found = report.windows(actor.training, model, 1)
    assert len(found) == 3 * len(report.WINDOWS) * 2
    assert found["record"].nunique() == 3
    means = found.groupby(["model", "window"])["filtered"].mean()
    assert (means["crf"] > means["hmm"]).all()
    assert means["hmm"].iloc[-1] < means["hmm"].iloc[0]
    assert np.isfinite(found[["chain", "filtered", "kinematics"]].to_numpy()).all()


def test_one_record_cannot_be_held_out(model):
    assert len(report.windows(Actor(6, records=2, duration_s=8.0).training, model, 1)) == 0


def test_the_regret_without_delay_is_that_of_the_online_controller(actor, model):
    layer, prosody = model.control, whole.prosody(model, actor.speech(), 300)
    found = report.regret(model, prosody)
    smoothed, delta = inference.smoothed(model.layer, prosody), layer.tones["neutral"].distances
    filtered = inference.filtered(model.layer, prosody)
    of_states = policy.solve(layer.cut, layer.rows, delta, model.layer.hmm.transitions, layer.discount)
    weights = Weights(layer.situations).of_each(filtered)
    for plan, known, played in (
        ("states", of_states, filtered), ("situations", layer.tones["neutral"].policy, weights),
    ):  # fmt: skip
        path = policy.play(known, layer.cut, layer.rows, played)
        cost = found.loc[found["plan"] == plan, "cost"].iloc[0]
        assert cost * 300 == pytest.approx(path_cost(path, layer.cut, layer.rows, delta, smoothed))
    assert (found["regret"] >= 0.0).all()
    curve = found[found["plan"] == "states"]
    assert curve["regret"].iloc[-1] < curve["regret"].iloc[0]
    assert curve["delay_ms"].tolist() == [100.0 * k for k in range(7)]


def test_facts_about_the_control_layer(model):
    facts = report.control_layer(model).set_index("quantity")["value"]
    assert facts["segments"] == len(model.control.kinematics)
    assert facts["library_s"] == 90.0
    assert 0.0 < facts["undominated_share"] < 1.0
    assert 0.01 < facts["printed_discount_error"] < 0.2
    assert 0.0 < facts["style_combination_error"] < 0.2


def test_decisions_are_those_of_the_motion(actor, model):
    prosody = whole.prosody(model, actor.speech(), 300)
    table, beliefs = report.decisions(model, prosody), report.beliefs(model, prosody)
    online_rows = table[table["policy"] == "online"]
    weights = Weights(model.control.situations).of_each(inference.filtered(model.layer, prosody))
    path = policy.play(model.control.tones["neutral"].policy, model.control.cut, model.control.rows, weights)
    np.testing.assert_array_equal(path.segment[online_rows["step"]], online_rows["segment"])
    np.testing.assert_array_equal(path.frame[online_rows["step"]], online_rows["frame"])
    totals = beliefs.groupby("step")[["forward", "smoothed"]].sum()
    np.testing.assert_allclose(totals, 1.0)
    assert set(table["policy"]) == {"online", "offline"}


def test_a_strip_shows_the_motion_relative_to_the_root(actor, model):
    speech, times_s = actor.speech(), [1.0, 7.5]
    table = report.strip(model, speech, times_s)
    motion = perform(SYSTEMS[0], Trained(online, model), speech, 0).motion
    for picture, time_s in enumerate(times_s):
        row = motion.iloc[[int(time_s * 20)]]
        places = skeleton.forward(row[list(skeleton.ROOT_COLUMNS)].to_numpy(), skeleton.angles(row))
        own = table[table["picture"] == picture].set_index("joint")
        for name in ("head", "left_hand", "right_foot"):
            expected = places[name][0] - places["hips"][0]
            np.testing.assert_allclose(
                own.loc[name, ["x_m", "y_m", "z_m"]].to_numpy(dtype=float), expected, atol=1e-9
            )
    assert table.set_index("joint").loc["left_hand", "parent"].iloc[0] == "left_forearm"


def test_another_library_has_a_control_layer_of_its_own(model):
    own = report.Segments(model.control.library, model.control.per_step, model.control.kinematics)
    layer, seconds = report.trained_on(model, own)
    np.testing.assert_array_equal(layer.tones["neutral"].policy.values, model.control.tones["neutral"].policy.values)
    assert list(layer.tones) == [control.NEUTRAL]
    assert seconds > 0.0
