"""What a system returns is checked against what it declares; one that fails leaves nothing, and the reason."""

import logging
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from coupled_actor import FRAME_S
from hypothesis import given
from hypothesis import strategies as st
from one_fold import HELD_OUT, SEED, SHARED, all_systems
from scipy.spatial.transform import Rotation

from cospeech.data import segments, tables
from cospeech.data.vocabulary import GESTURES
from cospeech.errors import UserError
from cospeech.motion import skeleton
from cospeech.synthesis import live
from cospeech.synthesis.declaration import System
from cospeech.synthesis.interface import Speech, Synthesis, decoding, phrases_of
from cospeech.synthesis.registry import installed
from cospeech.synthesis.session import Session, Trained, fault, method_of, nothing, perform, table_fault
from cospeech.synthesis.speech import Wrong

PLANNER = System(name="planner", title="Planner", method="elsewhere")
MOVER = System(name="mover", title="Mover", method="elsewhere", needs=("prosody",), makes="motion")
SPEECH = Speech("r", FRAME_S, 100, motion_fps=20.0, n_motion_frames=50)


def planned(starts=(0, 40), labels=("rest", "left"), **changed):
    """Phrases of the record as a system would return them, with some columns changed."""
    table = phrases_of(SPEECH, list(starts), list(labels)).assign(**changed)
    return Synthesis(decoding(SPEECH), phrases=table)


def moved(motion=None):
    return Synthesis(decoding(SPEECH), motion=skeleton.standing(50, 20.0) if motion is None else motion)


def test_what_is_right_has_no_fault():
    assert fault(PLANNER, planned(), SPEECH, GESTURES) is None
    assert fault(MOVER, moved(), SPEECH, GESTURES) is None
    assert fault(PLANNER, planned(labels=("rest", "dance")), SPEECH) is None  # any label


STANDING = skeleton.standing(50, 20.0)

NONSENSE = {
    "none": (PLANNER, None, "it returned an object of type NoneType, not Synthesis"),
    "table": (PLANNER, planned().phrases, "it returned an object of type DataFrame, not Synthesis"),
    "no phrases": (PLANNER, Synthesis(decoding(SPEECH)), "it returned no phrases"),
    "list": (PLANNER, Synthesis(decoding(SPEECH), phrases=["rest"]), "it returned no phrases"),
    "motion instead": (PLANNER, moved(), "it returned no phrases"),
    "phrases instead": (MOVER, planned(), "it returned no motion"),
    "both": (PLANNER, planned()._replace(motion=STANDING), "it also returned motion"),
    "both, moving": (MOVER, moved()._replace(phrases=planned().phrases), "it also returned phrases"),
    "too short": (
        PLANNER,
        planned()._replace(phrases=segments.from_starts("r", [0], ["rest"], 99, 1 / FRAME_S)),
        "its phrases for record 'r' end at frame 99; expected 100",
    ),
    "empty": (PLANNER, planned()._replace(phrases=planned().phrases.iloc[:0]), "its phrases: holds no segment"),
    "late start": (PLANNER, planned(starts=(3, 40)), "the first segment starts at frame 3, not at 0"),
    "gap": (PLANNER, planned(end_frame=[30, 100], end_s=[0.75, 2.5]), r"segment 0 \[0, 30\) is empty, or overlaps"),
    "overlap": (PLANNER, planned(end_frame=[50, 100], end_s=[1.25, 2.5]), r"segment 0 \[0, 50\) is empty, or"),
    "half a frame": (PLANNER, planned(start_frame=[0, 40.5]), "column 'start_frame': row 1 is 40.5"),
    "no end": (
        PLANNER,
        planned()._replace(phrases=planned().phrases.drop(columns="end_s")),
        "its phrases: column 'end_s' is missing",
    ),
    "no label": (PLANNER, planned(label=["rest", None]), "column 'label': row 1 is missing"),
    "strange label": (PLANNER, planned(labels=("rest", "dance")), "unknown label 'dance'; known are .*rest"),
    "strange column": (PLANNER, planned(mood="good"), "unknown column 'mood'"),
    "another record": (PLANNER, planned(record="s"), "its phrases are those of record 's'; expected 'r'"),
    "milliseconds": (
        PLANNER,
        planned(start_s=[0.0, 1000.0], end_s=[1000.0, 2500.0]),
        "the times of its phrases are not those of frames of 0.025 s",
    ),
    "no decoding": (PLANNER, planned()._replace(decoding=None), "its decoding is not a table of one row"),
    "two rows": (
        PLANNER,
        planned()._replace(decoding=pd.concat([decoding(SPEECH)] * 2)),
        "its decoding is not a table of one row",
    ),
    "half a decoding": (
        PLANNER,
        planned()._replace(decoding=pd.DataFrame({"record": ["r"]})),
        "its decoding: column 'draw' is missing",
    ),
    "decoding of another": (
        PLANNER,
        planned()._replace(decoding=decoding(replace(SPEECH, record="s"))),
        "its decoding is that of record 's'",
    ),
    "wrong length": (
        MOVER,
        moved(STANDING.iloc[:-1]),
        "its motion for record 'r' has 49 frames; expected 50",
    ),
    "no motion": (MOVER, moved(STANDING.iloc[:0]), "has 0 frames; expected 50"),
    "no hand": (
        MOVER,
        moved(STANDING.drop(columns="left_hand_x_deg")),
        "its motion for record 'r' lacks the column 'left_hand_x_deg'",
    ),
    "third arm": (MOVER, moved(STANDING.assign(third_arm_x_deg=0.0)), "has an unknown column 'third_arm_x_deg'"),
    "not a number": (MOVER, moved(STANDING.assign(head_x_deg=np.nan)), "column 'head_x_deg': row 0 is missing"),
    "infinite": (MOVER, moved(STANDING.assign(head_x_deg=np.inf)), "column 'head_x_deg': row 0 is inf"),
    "text": (MOVER, moved(STANDING.assign(head_x_deg="up")), "column 'head_x_deg'"),
    "wrong rate": (
        MOVER,
        moved(skeleton.standing(50, 25.0)),
        "the frames of its motion for record 'r' are not those of 20 frames per second",
    ),
    "backwards": (MOVER, moved(STANDING.iloc[::-1]), "are not those of 20 frames per second"),
}


@pytest.mark.parametrize("name", NONSENSE)
def test_each_kind_of_nonsense_is_named(name):
    system, made, message = NONSENSE[name]
    found = fault(system, made, SPEECH, GESTURES)
    with pytest.raises(AssertionError, match=message):
        raise AssertionError(found)


@given(st.sets(st.integers(1, 99), max_size=20), st.randoms(use_true_random=False))
def test_any_phrases_that_fill_the_record_are_right_and_any_others_are_not(cuts, random):
    starts = [0, *sorted(cuts)]
    made = planned(starts, [random.choice(GESTURES) for _ in starts])
    assert fault(PLANNER, made, SPEECH, GESTURES) is None
    row = random.randrange(len(starts))
    for broken in (made.phrases.drop(index=row), pd.concat([made.phrases, made.phrases.iloc[[row]]])):
        assert fault(PLANNER, made._replace(phrases=broken), SPEECH, GESTURES) is not None


def test_a_system_of_cospeech_is_checked_as_well(one_fold, monkeypatch):
    system = installed("hsmm")
    method = method_of(system)
    right = method.synthesise
    monkeypatch.setattr(
        method, "synthesise", lambda model, speech, seed: right(model, replace(speech, n_frames=1599), seed)
    )
    with pytest.raises(
        UserError, match=r"'hsmm' declares that it makes phrases, but .* end at frame 1599; expected 16"
    ):
        one_fold.session().synthesise(system, one_fold.driving())
    monkeypatch.setattr(method, "synthesise", lambda model, speech, seed: 1 / 0)
    with pytest.raises(ZeroDivisionError):  # a defect in cospeech, which keeps its traceback
        one_fold.session().synthesise(system, one_fold.driving())


# ---------------------------------------------------------------- models


def test_systems_that_share_a_model_train_it_once(one_fold, monkeypatch):
    systems = all_systems()
    trained = []
    right = method_of(systems["hsmm"]).train
    for name in ("hsmm", "hsmm_weighted", "hsmm_sampled", "prior"):
        monkeypatch.setattr(
            method_of(systems[name]), "train", lambda *args, name=name: trained.append(name) or right(*args)
        )
    session = one_fold.session()
    for system in systems.values():
        session.synthesise(system, one_fold.driving())
    assert trained == ["hsmm"]


def test_a_system_gets_the_shared_settings_and_its_own(one_fold, packages):
    packages.install_toy()
    toy = installed("toy_habits")
    session = Session(one_fold.training, SHARED, {"toy_habits": {"shortest_s": 1.25}, "toy_lift": {"highest_deg": 9}})
    assert session.tables(toy)["timing"]["shortest_s"].tolist() == [1.25]
    assert session.tables(installed("toy_habits_shifted"))["timing"]["shortest_s"].tolist() == [1.25]
    assert session.tables(installed("toy_lift"))["lift"]["highest_deg"].tolist() == [9]
    assert one_fold.session().tables(toy)["timing"]["shortest_s"].tolist() == [0.5]


MODEL = System(name="m", title="M", method="elsewhere", tables={"order": "record_order", "decoder": "decoder"})
ORDER = pd.DataFrame({"record": ["a"]})
DECODER = pd.DataFrame({"emission_weight": [1.0], "censoring": ["none"], "frame_s": [FRAME_S]})


def test_tables_of_a_model_are_those_that_it_declares():
    assert table_fault(MODEL, {"order": ORDER, "decoder": DECODER}) is None
    assert table_fault(MODEL, None) == "it returned no tables by name"
    assert table_fault(MODEL, {"order": ORDER, "decoder": [1]}) == "it returned no tables by name"
    assert table_fault(MODEL, {"order": ORDER}) == "it returned order"
    assert table_fault(MODEL, {}) == "it returned none"
    assert (
        table_fault(MODEL, {"order": ORDER, "decoder": DECODER, "more": ORDER}) == "it returned order, decoder, more"
    )
    wrong = {"order": ORDER, "decoder": DECODER.assign(emission_weight=-1.0)}
    assert "its table 'decoder': column 'emission_weight': row 0 is -1.0" in table_fault(MODEL, wrong)


# ---------------------------------------------------------------- systems of other packages


def test_the_toys_do_what_they_say(one_fold, packages):
    packages.install_toy()
    session, driving = one_fold.session(), one_fold.driving()
    made = {
        name: session.attempt(installed(name), driving)[0] for name in all_systems("toy-gestures") if "toy_" in name
    }
    assert [one.decoding["failure"].iloc[0] for one in made.values()] == [None] * len(made)
    durations = np.diff(made["toy_habits"].phrases[["start_s", "end_s"]].to_numpy())
    assert (durations[:-1] >= 0.5).all()
    intensity = one_fold.prosody_tables[HELD_OUT]
    motion = made["toy_lift"].motion
    hands = skeleton.forward(np.zeros((len(motion), 3)), skeleton.angles(motion))["left_hand"][:, 1]
    there = np.interp(motion["time_s"], intensity["time_s"], intensity["intensity"])
    assert np.corrcoef(hands, there)[0, 1] > 0.9
    shifted = np.interp(motion["time_s"], intensity["time_s"], np.roll(intensity["intensity"], -100))
    assert abs(np.corrcoef(hands, shifted)[0, 1]) < 0.2
    row = made["toy_lift_shifted"].decoding.iloc[0]
    moved_by = round(row["shift_s"] / FRAME_S)
    moved_there = np.interp(motion["time_s"], intensity["time_s"], np.roll(intensity["intensity"], -moved_by))
    angles = made["toy_lift_shifted"].motion["left_forearm_x_deg"]
    assert np.corrcoef(angles, moved_there)[0, 1] < -0.9


def test_a_live_system_makes_the_same_step_by_step(one_fold, packages):
    """What the steps return while speech is heard is what the system makes of the whole record."""
    packages.install_toy()
    system, driving = installed("toy_lift"), one_fold.driving()
    session = one_fold.session()
    whole = session.synthesise(system, driving)[0].motion
    method, model = session.trained(system)
    speech = driving.speeches(system)[0]
    state = method.start(model, live.Stream(speech.record, speech.frame_s, speech.motion_fps), 0)
    shown = 0
    for heard in live.frames(speech):
        new = method.step(state, heard)
        assert (new["time_s"] <= heard.time_s + 1e-9).all()  # nothing is shown before it is heard
        pd.testing.assert_frame_equal(new, whole.iloc[shown : shown + len(new)].reset_index(drop=True))
        shown += len(new)
    assert shown >= len(whole) - 1
    rest = method.end(state, speech)
    pd.testing.assert_frame_equal(rest, whole.iloc[shown:].reset_index(drop=True))


def test_frames_of_live_speech_carry_what_the_record_has(one_fold):
    speech = one_fold.driving().speeches(all_systems()["hsmm"])[0]
    heard = list(live.frames(speech))
    assert [one.frame for one in heard] == list(range(speech.n_frames))
    assert [one.label for one in heard] == speech.labels.tolist()
    if speech.prosody is not None:
        assert [one.features["intensity"] for one in heard] == speech.prosody["intensity"].tolist()


def test_syllables_are_heard_with_the_frame_at_whose_end_they_are_known(one_fold):
    speech = one_fold.driving().speeches(all_systems()["hsmm"])[0]
    known_s = np.array([0.0, 0.0249, 0.025, 0.0251, 3 * 0.025, 0.1 + 1e-12, 1e6])
    table = pd.DataFrame(
        {"record": "r1", "syllable": np.arange(7), "known_s": known_s, "f0_hz": [np.nan] + [100.0] * 6}
    )
    heard = list(live.frames(replace(speech, syllables=table)))
    frames = {int(row["syllable"]): one.frame for one in heard for row in one.syllables}
    assert frames == {0: 0, 1: 0, 2: 0, 3: 1, 4: 2, 5: 3}  # the last one becomes known after the speech
    assert np.isnan(heard[0].syllables[0]["f0_hz"])
    assert heard[0].syllables[1] == {"syllable": 1.0, "known_s": 0.0249, "f0_hz": 100.0}


def test_poses_that_a_live_system_makes_become_a_motion_table():
    rng = np.random.default_rng(3)
    angles = np.cumsum(rng.normal(size=(40, len(skeleton.JOINTS), 3)), axis=0)
    turns = Rotation.from_matrix(skeleton.rotations(angles).reshape(-1, 3, 3))
    poses = turns.as_quat(scalar_first=True).reshape(40, -1) * rng.choice([-1.0, 1.0], (40, 1))
    root = rng.normal(size=(40, 3))
    rows = np.hstack([root, poses])
    made = live.motion_table([rows[:15], rows[15:16], rows[16:]], 20.0)
    pd.testing.assert_frame_equal(made, skeleton.motion_table(root, angles, 20.0), atol=1e-9)


FAILING = """
import numpy as np
import pandas as pd
from cospeech.motion import skeleton
from cospeech.synthesis.declaration import System
from cospeech.synthesis.interface import Synthesis, decoding, phrases_of

SYSTEM = System(name="failing", title="Failing", method="failing", {declared})


def train(training, settings):
    return {model}


def synthesise(model, speech, seed):
    return {made}


def to_tables(model):
    return {tables}


def from_tables(tables):
    return None
"""
PHRASES = "Synthesis(decoding(speech), phrases=phrases_of(speech, [0], ['rest']))"
MAKES_MOTION = "needs=('prosody',), makes='motion'"
FAILURES = {
    "train": ({"model": "1 / 0"}, "needs gestures, prosody_labels and makes phrases: ZeroDivisionError: division by"),
    "exit": ({"model": "exit(3)"}, "needs gestures, prosody_labels and makes phrases: SystemExit: 3"),
    "synthesise": (
        {"made": "speech.labels['a']", "declared": MAKES_MOTION},
        "needs prosody and makes motion: IndexError: ",
    ),
    "lines": ({"made": "int('one\\n two')"}, r"makes phrases: ValueError: invalid literal .* 'one\\n two'"),
    "motion": (
        {"made": "Synthesis(decoding(speech), motion=skeleton.standing(7, 20.0))", "declared": MAKES_MOTION},
        "declares that it makes motion, but its motion for record 'r1' has 7 frames; expected 800",
    ),
    "label": (
        {"made": "Synthesis(decoding(speech), phrases=phrases_of(speech, [0], ['dance']))"},
        "declares that it makes phrases, but its phrases have an unknown label 'dance'; known are",
    ),
    "to_tables": ({"tables": "model.tables"}, "AttributeError: 'NoneType' object has no attribute 'tables'"),
    "no tables": (
        {"tables": "{}", "declared": "tables={'order': 'record_order'}"},
        "declares that its model consists of the tables order, but it returned none",
    ),
    "schema": (
        {"tables": "{'order': pd.DataFrame({'record': ['a', 'a']})}", "declared": "tables={'order': 'record_order'}"},
        "but its table 'order': row 1 repeats the key",
    ),
    "no schema": (
        {"tables": "{'order': pd.DataFrame({'record': ['a']})}", "declared": "tables={'order': 'nowhere'}"},
        "KeyError: 'no schema nowhere.yaml",
    ),
    "no package": (
        {"tables": "{'a': pd.DataFrame()}", "declared": "tables={'a': 'b'}, schemas='no_such_package'"},
        "schema 'no_such_package:b': no package 'no_such_package' is installed",
    ),
}


def install_failing(packages, **changed):
    text = {"declared": "", "model": "None", "made": PHRASES, "tables": "{}"} | changed
    packages.install("failing", FAILING.format(**text))
    return installed("failing")


@pytest.mark.parametrize("name", FAILURES)
def test_a_failure_is_named_in_one_line_and_leaves_empty_tables(one_fold, packages, tmp_path, name):
    changed, reason = FAILURES[name]
    system = install_failing(packages, **changed)
    [made] = one_fold.session().attempt(system, one_fold.driving())
    failure = made.decoding["failure"].iloc[0]
    assert failure.startswith("system 'failing'")
    assert "\n" not in failure
    with pytest.raises(UserError, match=reason):
        raise UserError(failure)
    table, schema = (made.motion, "motion") if system.makes == "motion" else (made.phrases, "segments")
    assert len(table) == 0
    assert (made.phrases is None) == (system.makes == "motion") == (made.motion is not None)
    for own, path in ((table, schema), (made.decoding, "decoding")):
        tables.write(own, tmp_path / path, path, corpus="virtual", config_hash="0")
        assert len(tables.read(tmp_path / path, path)) == len(own)


def test_without_a_failure_nothing_is_missing(one_fold, packages):
    system = install_failing(packages)
    [made] = one_fold.session().attempt(system, one_fold.driving())
    assert made.decoding["failure"].iloc[0] is None
    assert made.phrases["label"].tolist() == ["rest"]


def test_phrases_that_no_training_record_shows_cannot_become_motion(one_fold, packages):
    system = install_failing(packages)
    others = {name: table.assign(label="left") for name, table in one_fold.training.gestures.items()}
    session = Session(replace(one_fold.training, gestures=others), SHARED, {})
    failure = session.attempt(system, one_fold.driving())[0].decoding["failure"].iloc[0]
    assert failure == "system 'failing': no label of its phrases occurs in the training records"


def test_the_log_gets_the_traceback_of_a_failure(one_fold, packages, caplog):
    system = install_failing(packages, made="speech.no_such_attribute")
    with caplog.at_level(logging.INFO, "cospeech"):
        one_fold.session().attempt(system, one_fold.driving())
    assert "failing.py" in caplog.text
    assert "no_such_attribute" in caplog.text


def test_a_record_that_is_too_short_for_a_control_is_not_its_failure(one_fold, packages):
    install_failing(packages)
    driving = one_fold.driving()._replace(wrong=Wrong(30.0))
    assert one_fold.session().attempt(installed("failing_shifted"), driving) == []
    assert len(one_fold.session().attempt(installed("failing_shuffled"), driving)) == len(one_fold.training.order) - 1


def test_new_speech_is_checked_too(packages):
    system = install_failing(packages, made="Synthesis(decoding(speech), phrases=phrases_of(speech, [1], ['rest']))")
    trained = Trained(method_of(system), None)
    with pytest.raises(
        UserError, match="'failing' declares that it makes phrases, but its phrases: the first segment"
    ):
        perform(system, trained, SPEECH, SEED)


def test_nothing_says_which_record_it_stands_for():
    for system in (PLANNER, MOVER):
        made = nothing(system, replace(SPEECH, record=HELD_OUT), "it\n was\ttoo hard")
        assert made.decoding["record"].tolist() == [HELD_OUT]
        assert made.decoding["failure"].tolist() == ["it was too hard"]
