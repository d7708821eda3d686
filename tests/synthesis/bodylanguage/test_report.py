"""The material of the thesis's exhibits."""

import numpy as np
import pytest
import speaking_body
from small_chain import random_chain

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.synthesis import live
from cospeech.synthesis.bodylanguage import SYSTEMS, forward, model, observations, proposed, report
from cospeech.synthesis.session import Driving, Session
from cospeech.synthesis.speech import Streams, Wrong


@pytest.fixture(scope="module")
def found(training, trained):
    return proposed.report(training, trained, speaking_body.speech(), 2012)


def test_reports_follow_their_schemas(found):
    schemas = SYSTEMS[0].report_schemas
    assert set(found) == set(schemas)
    for name, schema in schemas.items():
        tables.validate(found[name], schema, name)


def test_decisions_are_those_of_the_motion(trained, found):
    """Where the arms hold a new subunit, blending has started toward it: the decisions fill the record in order."""
    for _, rows in found["decisions"].groupby("section"):
        assert rows["frame"].is_monotonic_increasing
        assert rows["frame"].iloc[0] == 0
    speech = speaking_body.speech()
    player = proposed.start(trained, live.Stream("new", speech.frame_s, speech.motion_fps), 2012)
    starts = {section: [] for section in model.SECTIONS}
    for heard in live.frames(speech):
        made = len(player.hear(heard))
        for s, section in enumerate(model.SECTIONS):
            if made and player.memory.frame[s] == 1:
                starts[section].append(player.n_frames - 1)
    for section, frames in starts.items():
        rows = found["decisions"][found["decisions"]["section"] == section]
        assert rows["frame"].tolist() == frames


def test_every_observation_of_the_training_records_is_counted(training, found):
    table = found["occurrences"]
    total = sum(len(one) for one in model.observe(training).values())
    assert table["count"].sum() == total
    assert (table.loc[~table["can_occur"], "count"] == 0).all()
    assert table["can_occur"].sum() == 26


def test_selections_are_the_largest_probabilities_and_follow_their_own_past():
    rng = np.random.default_rng(0)
    for _ in range(10):
        chain = random_chain(rng, 4)
        times = np.cumsum(rng.uniform(0.05, 0.4, 40))
        observed = [
            observations.Observed(int(rng.choice(observations.OCCURRING)), 0.0, time_s, time_s) for time_s in times
        ]
        table = report.selections(chain, observed)
        np.testing.assert_allclose(table.groupby("step")["forward"].sum(), 1.0)
        assert len(table) == 40 * 8
        for name in ("by_direct", "by_product"):
            chosen = table[table[name]]
            assert chosen["step"].tolist() == list(range(40))
            shown = chain.initial.argmax()
            for row in chosen.itertuples():
                assert row.start or row.cluster == shown  # only the shown subunit can be continued
                shown = row.cluster
        means = [np.log(table.loc[table[name], "forward"]).mean() for name in ("by_direct", "by_product")]
        assert means[1] >= means[0]


def test_errors_of_the_expected_share_are_zero_without_continuations_and_larger_as_printed():
    rng = np.random.default_rng(1)
    chains = {"arms": random_chain(rng, 4), "legs": random_chain(rng, 3)}
    observed = [
        observations.Observed(int(rng.choice(observations.OCCURRING)), 0.0, t, t) for t in np.arange(60) * 0.2
    ]
    table = report.elapsed_errors(chains, observed).set_index(["section", "mode"])
    for section in chains:
        expected, printed = table.loc[(section, "expected")], table.loc[(section, "printed")]
        assert 0.0 < expected["variation_mean"] < printed["variation_mean"]
        assert expected["variation_mean"] <= expected["variation_max"]
        assert expected["share_error"] < printed["share_error"]
    never = chains["arms"]._replace(
        continuing=np.zeros(4), after_start=np.full((4, 4), 0.25), logit=np.full((4, 2), [-50.0, 0.0])
    )
    none = report.elapsed_errors({"arms": never}, observed)
    np.testing.assert_allclose(none["variation_max"], 0.0, atol=1e-12)
    assert forward.MODES == ("exact", "expected", "printed")


def test_a_session_runs_the_systems_on_one_model_and_checks_their_reports(training, monkeypatch):
    trained_on = []
    train = proposed.train
    monkeypatch.setattr(proposed, "train", lambda *given: trained_on.append(given) or train(*given))
    speech = speaking_body.speech()
    streams = Streams({"new": np.full(speech.n_frames, "p1", dtype=object)}, syllables={"new": speech.syllables})
    driving = Driving(streams, "new", speech.frame_s, 2012, Wrong(5.0), speech.motion_fps, speech.n_motion_frames)
    session = Session(training, {}, {})
    made = {system.name: session.synthesise(system, driving)[0].motion for system in SYSTEMS}
    made["shifted"] = session.synthesise(SYSTEMS[0].matched_controls()[1], driving)[0].motion
    assert len(trained_on) == 1
    assert len({table["left_arm_x_deg"].sum() for table in made.values()}) == len(made)
    assert set(session.reports(SYSTEMS[0], driving)) == set(SYSTEMS[0].reports)
    monkeypatch.setattr(proposed, "report", lambda *given: {})
    with pytest.raises(UserError, match=r"declares the reports decisions, .*, but it returned none"):
        session.reports(SYSTEMS[0], driving)
