"""``cospeech library``: controllers with other motion, of people and of other bodies, and keywords."""

import numpy as np
import pytest
from vigorous import FPS, FRAME_S, QUICK, Actor, hand_speed

from cospeech import api, cli
from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.formats import bvh, sound
from cospeech.live import engine, performing
from cospeech.markov import labelled_hmm
from cospeech.synthesis import live
from cospeech.synthesis.controller import SYSTEMS, online
from cospeech.workflow import model_folder

CONTROLLER = SYSTEMS[0]


@pytest.fixture(scope="module")
def actor():
    return Actor(1, records=3, duration_s=20.0)


@pytest.fixture(scope="module")
def model(actor, tmp_path_factory):
    """The folder of a controller, as the workflow writes it."""
    folder = tmp_path_factory.mktemp("models") / "controller"
    trained = online.train(actor.training, QUICK)
    named = {name: (table, CONTROLLER.table_schemas[name]) for name, table in online.to_tables(trained).items()}
    named |= {f"motion~{name}": (motion, "motion") for name, motion in actor.training.motions.items()}
    bundled = api.load_model()
    named["gestures"] = (tables.empty("segments"), "segments")
    named["gesture_model"] = (labelled_hmm.to_table(bundled.gesture_model), "hmm_model")
    named["prosody_model"] = (labelled_hmm.to_table(bundled.prosody_model), "hmm_model")
    card = {
        **{key: bundled.card[key] for key in ("version", "seed", "speech", "continuity_weight", "smoothing")},
        **{"system": "controller", "variant": "main", "actor": "actor", "held_out": None, "motion_fps": FPS},
        "records": list(actor.training.motions),
    }
    model_folder.write(folder, card, named, corpus="test", config_hash="x")
    return folder


@pytest.fixture
def call(capsys, tmp_path, monkeypatch, model):
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        capsys.readouterr()
        status = cli.main(["library", *map(str, arguments), "--model", str(model)])
        printed = capsys.readouterr()
        return status, printed.out.splitlines(), printed.err.splitlines()

    return run


TURNS = "3 Zrotation Xrotation Yrotation"

CLAW = f"""JOINT claw{{i}}
{{{{
OFFSET {{x}} 1 {{z}}
CHANNELS {TURNS}
JOINT tip{{i}}
{{{{
OFFSET 0 3 0
CHANNELS {TURNS}
}}}}
}}}}
"""


def crab(path, n=240, fps=20.0):
    """A body with four claws that wave faster and faster, then rest, again and again."""
    places = [(1, 1), (1, -1), (-1, 1), (-1, -1)]
    claws = "".join(CLAW.format(i=i, x=x, z=z) for i, (x, z) in enumerate(places))
    times = np.arange(n) / fps
    waving = np.where(times % 3 < 2, np.sin((3 + times % 3) * times), 0.0)
    columns = [np.zeros(n)] * 6
    for i in range(4):
        columns += [(20 + 10 * i) * waving, *[np.zeros(n)] * 5]
    channels = f"6 Xposition Yposition Zposition {TURNS[2:]}"
    rows = "\n".join(" ".join(f"{value:.5f}" for value in row) for row in np.array(columns).T)
    path.write_text(
        f"HIERARCHY\nROOT shell\n{{\nOFFSET 0 0 0\nCHANNELS {channels}\n{claws}}}\n"
        f"MOTION\nFrames: {n}\nFrame Time: {1 / fps:.6f}\n{rows}\n"
    )


def hummed():
    """Two seconds of a hum at 16 kHz that gets louder and softer."""
    times = np.arange(32000) / 16000
    tone = sum(np.sin(2 * np.pi * 120 * k * times) / k for k in range(1, 12))
    return 0.2 * tone * (0.55 + 0.45 * np.sin(2 * np.pi * 3 * times))


def frames_of(folder, speech):
    """The motion that a model makes live, (T, 3 + 4 J)."""
    trained = api.load_model(folder).trained
    state = trained.method.start(trained.model, live.Stream("r", FRAME_S, FPS), 0)
    parts = [trained.method.step(state, heard) for heard in live.frames(speech)]
    return np.concatenate([*parts, trained.method.end(state, speech)])


def test_other_motion_of_a_person_is_shown_for_new_speech(call, actor, tmp_path):
    (tmp_path / "motions").mkdir()
    slower = actor.motions[actor.new].iloc[::2].reset_index(drop=True)
    slower["frame"], slower["time_s"] = np.arange(len(slower)), (np.arange(len(slower)) + 0.5) / FPS
    bvh.write(slower, tmp_path / "motions" / "other.bvh")
    status, out, err = call("motions", "--out", "made")
    assert (status, out) == (0, ["made"])
    assert err[-1].endswith("of 1 recordings, 10 s, hands: left_hand, right_hand")
    made = api.synthesize(hummed(), api.load_model("made"))
    assert len(made.motion) == 40
    assert hand_speed(made.motion).max() < 10.0


def test_another_body_moves_with_the_same_inference_layer(call, actor, tmp_path):
    (tmp_path / "crab").mkdir()
    crab(tmp_path / "crab" / "dance.bvh")
    status, out, err = call("crab", "--out", "made", "--unit", "cm")
    assert (status, out) == (0, ["made"])
    assert err[-1].endswith("hands: tip1, tip2, tip3")
    speech = actor.speech()
    frames = frames_of("made", speech)
    assert frames.shape == (speech.n_motion_frames, 3 + 4 * 9)
    np.testing.assert_allclose(np.linalg.norm(frames[:, 3:].reshape(-1, 9, 4), axis=2), 1.0)
    read = api.load_model("made").trained.model
    assert online.body(read).joints[0] == "shell"
    assert list(online.to_tables(read)["library"]["record"].unique()) == ["dance"]
    with pytest.raises(UserError, match=r"another body, of 9 joints, .* 'cospeech live'"):
        api.synthesize(hummed(), api.load_model("made"))


def test_keywords_are_given_to_the_motion_that_a_controller_has(call, actor, tmp_path):
    (tmp_path / "words.csv").write_text("word;segment\nbig;3\nbig;7\nsmall;1\n")
    status, _, err = call("--keywords", "words.csv", "--out", "made")
    assert status == 0
    assert len(err) == 1
    trained = api.load_model("made").trained
    assert trained.model.control.keywords == {"big": (3, 7), "small": (1,)}
    assert len(frames_of("made", actor.speech())) == actor.speech().n_motion_frames


@pytest.fixture
def spoken(tmp_path):
    """Two seconds of sound, the word 'Big' from 0.5 to 0.8 s, and its gestures."""
    sound.write(hummed(), tmp_path / "hum.wav")
    (tmp_path / "said.csv").write_text("start_s,end_s,word\n0.2,0.4,so\n0.5,0.8,Big\n")
    (tmp_path / "words.csv").write_text("word,segment\nbig,3\nbig,7\n")
    return ["synthesize", "hum.wav", "--format", "table", "--words", "said.csv"]


def test_keywords_of_a_record_act_as_keywords_that_are_heard_live(call, spoken, model):
    assert cli.main([*spoken, "--keywords", "words.csv", "--model", str(model)]) == 0
    made = tables.read("hum.motion.parquet", "motion")
    loaded = api.with_keywords(api.load_model(model), {"big": (3, 7)})
    without = api.synthesize(hummed(), loaded, record="hum").motion
    hearing = engine.listening(loaded, 16000)
    moving = performing.performer(loaded, hearing, 0)
    frames = []
    for heard in hearing.push(sound.to_16_bit(hummed()) / 32768):
        if heard.frame == 31:  # ends at 0.8 s
            moving.prepare("keyword", "big")()
        frames.append(moving.step(heard))
    frames.append(moving.end(hearing.n_samples))
    shown = live.motion_table([part for part in frames if len(part)], FPS)
    np.testing.assert_array_equal(made[shown.columns], shown)
    first = np.flatnonzero((made != without).any(axis=1))[0]
    assert 0.8 * FPS - 1 <= first < len(made) - 5


def test_wrong_words_are_one_line(call, spoken, model, tmp_path, capsys):
    (tmp_path / "other.csv").write_text("word,segment\nbag,3\n")
    (tmp_path / "none.csv").write_text("word,segment\nbig,9999\n")
    (tmp_path / "late.csv").write_text("start_s,end_s,word\n8.5,8.8,Big\n")
    own = ["--model", str(model)]
    for arguments, message in (
        (
            [*spoken, *own],
            "hum.wav: this model of 'controller' has no keywords; give a gesture controller some first",
        ),
        (
            [*spoken, *own, "--keywords", "other.csv"],
            "none of the keywords bag is among the words; did you mean 'big'?",
        ),
        (
            [*spoken, *own, "--keywords", "none.csv"],
            "keyword 'big' has segment 9999, which the library does not have",
        ),
        (
            [*spoken[:-1], "late.csv", *own, "--keywords", "words.csv"],
            "the word 'Big' ends at 8.800 s, but the sound",
        ),
        ([*spoken, "--keywords", "words.csv"], "keywords need a model of 'controller', and this is one of 'hsmm"),
    ):
        capsys.readouterr()
        assert cli.main(arguments) == 1
        assert message in capsys.readouterr().err.splitlines()[-1]
    assert not (tmp_path / "hum.motion.parquet").exists()


def still(folder):
    folder.mkdir()
    crab(folder / "one.bvh", n=4)


WRONG = {
    "nothing to build": (("--out", "made"), "nothing to build: name a folder of motion files, or keywords"),
    "no folder": (("nowhere", "--out", "made"), "nowhere: is not a folder"),
    "hands of nothing": (
        ("--keywords", "words.csv", "--hands", "a", "--out", "made"),
        "--hands: names joints of motion files, but no folder of these is given",
    ),
    "taken": (("short", "--out", "short"), "short: already exists; name a new folder with --out"),
    "one segment": (
        ("short", "--out", "made"),
        "short: its motion has only one segment, and a controller needs several",
    ),
    "unknown hand": (("short", "--hands", "claw9", "--out", "made"), "no joint 'claw9'; did you mean 'claw"),
    "no such segment": (("--keywords", "words.csv", "--out", "made"), "keyword 'big' has segment 9999, which"),
    "not a number": (("--keywords", "bad.csv", "--out", "made"), "bad.csv: line 2: keyword 'big' with segment 'x'"),
    "no column": (("--keywords", "other.csv", "--out", "made"), "other.csv: has no column 'segment'"),
    "no row": (("--keywords", "none.csv", "--out", "made"), "none.csv: contains no keyword"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input_is_one_line_and_leaves_nothing(case, call, tmp_path):
    still(tmp_path / "short")
    for name, text in (
        ("words", "word,segment\nbig,9999\n"), ("bad", "word,segment\nbig,x\n"), ("other", "word,gesture\nbig,1\n"),
        ("none", "word,segment\n"),
    ):  # fmt: skip
        (tmp_path / f"{name}.csv").write_text(text)
    arguments, reason = WRONG[case]
    status, out, err = call(*arguments)
    assert (status, out) == (1, [])
    assert len(err) == 1
    assert err[0].startswith("cospeech: ")
    assert reason in err[0]
    assert not (tmp_path / "made").exists()
