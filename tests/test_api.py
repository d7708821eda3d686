"""The functions for notebooks: every example in their docstrings runs, and what they return is consistent."""

import doctest
import inspect
import shutil

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cospeech import api
from cospeech.api import heads, trained
from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.formats import sound
from cospeech.motion import skeleton

EXAMPLES = [
    test
    for module in (api, heads, trained)
    for test in doctest.DocTestFinder().find(module, "api", globs={"api": api})
    if test.examples
]


@pytest.fixture(scope="session")
def model():
    return api.load_model()


@pytest.fixture(scope="session")
def speech(recordings):
    return sound.read(recordings / "speech.wav").samples


@pytest.fixture
def folder(recordings, tmp_path, monkeypatch):
    """The current folder, with the files that the examples name."""
    shutil.copytree(recordings, tmp_path, dirs_exist_ok=True)
    record = api.load_record(tmp_path / "talk_1.bvh", tmp_path / "talk_1.wav", "ada_1")
    run = tmp_path / "results" / "demo"
    tables.write(record.motion, run / "motion" / "ada_1.parquet", "motion", corpus="virtual", config_hash="0")
    tables.write(
        record.prosody, run / "speech" / "ada_1" / "prosody.parquet", "prosody", corpus="virtual", config_hash="0"
    )
    sound.write(record.sound, run / "corpus" / "audio" / "ada_1.wav")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.name)
def test_examples(folder, example):
    report = []
    runner = doctest.DocTestRunner(verbose=False)
    runner.run(example, out=report.append)
    assert runner.failures == 0, "".join(report)


def test_every_function_has_an_example():
    functions = inspect.getmembers(api, inspect.isfunction)
    public = {f"api.{name}" for name, _ in functions if name in api.__all__}
    assert {example.name for example in EXAMPLES} == public | {"api"}


def test_a_record_is_the_same_from_its_files_and_from_the_results_of_a_run(folder):
    from_files = api.load_record("talk_1.bvh", "talk_1.wav", "ada_1")
    from_run = api.record_of_run("results/demo", "ada_1")
    np.testing.assert_array_equal(from_files.sound, from_run.sound)
    assert from_files.prosody.equals(from_run.prosody)
    assert from_files.motion.equals(from_run.motion)
    with pytest.raises(UserError, match=r"ada_2\.parquet: no such file"):
        api.record_of_run("results/demo", "ada_2")


def test_a_record_without_sound_has_its_prosody(folder):
    (folder / "results/demo/corpus/audio/ada_1.wav").unlink()
    record = api.record_of_run("results/demo", "ada_1")
    assert record.sound is None
    assert len(record.prosody) == 480


def test_training_needs_records():
    with pytest.raises(UserError, match="no records to train on"):
        api.train([])
    with pytest.raises(UserError, match="no installed package has a system 'hsmn'; did you mean 'hsmm'"):
        api.train([api.Record("a", skeleton.standing(1, 20.0), None, None)], "hsmn")


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 80_000), st.integers(12_000, 80_000))  # shorter excerpts are often without voice
def test_motion_is_as_long_as_the_sound_to_the_frame(model, speech, first, length):
    excerpt = speech[first : first + length]
    try:
        made = api.synthesize(excerpt, model)
    except UserError:  # nothing is voiced
        assume(False)
    assert len(made.motion) == round(length / 16000 * 25)
    assert np.isfinite(skeleton.angles(made.motion)).all()
    assert made.phrases["end_frame"].iloc[-1] == length // 400
    tables.validate(made.motion, "motion", "made")
    tables.validate(made.phrases, "segments", "made")


def test_the_body_is_that_of_the_given_motion_and_the_arms_are_not(model, speech):
    root = np.random.default_rng(1).normal(0, 0.1, (250, 3))
    angles = np.random.default_rng(2).normal(0, 5, (250, len(skeleton.JOINTS), 3))
    body = skeleton.motion_table(root, angles, 25.0)
    made, still = (api.synthesize(speech, model, body=given).motion for given in (body, None))
    arms = skeleton.angle_columns((*skeleton.ARM_JOINTS, "left_hand", "right_hand"))
    others = [name for name in skeleton.columns() if name not in arms]
    assert made[others].equals(body[others])
    assert made[arms].equals(still[arms])
    assert (still[others[2:]] == 0).all(axis=None)
    # A workflow leaves out a last frame that the sound fills by half or more, but not wholly.
    assert len(api.synthesize(speech, model, body=body[:249]).motion) == 249
    for wrong in (body[:248], skeleton.motion_table(root, angles, 30.0)):
        with pytest.raises(UserError, match=r"the motion of the body has .* needs 250 at 25 fps"):
            api.synthesize(speech, model, body=wrong)


def test_seed_and_name_decide_what_is_drawn(model, speech):
    def made(**options):
        return api.synthesize(speech, model, **options).motion

    own = made()
    assert own.equals(made(seed=model.card["seed"]))
    assert own.equals(made(record="speech"))
    assert not own.equals(made(seed=1))
    assert not own.equals(made(record="talk"))


def test_a_system_of_motion_has_the_phrases_that_are_seen_in_it(model, speech):
    from dataclasses import replace
    from types import SimpleNamespace

    from cospeech.synthesis.interface import Synthesis, decoding

    def synthesise(trained, heard, seed):
        table = next(iter(model.motions.values())).iloc[: heard.n_motion_frames]
        return Synthesis(decoding(heard), motion=table)

    method = SimpleNamespace(synthesise=synthesise)
    mover = model._replace(
        system=replace(model.system, makes="motion"), trained=model.trained._replace(method=method)
    )
    made = api.synthesize(speech, mover)
    assert made.motion.equals(next(iter(model.motions.values())).iloc[:250])
    assert made.phrases["end_frame"].iloc[-1] == 250
    assert len(set(made.phrases["label"])) > 1
    with pytest.raises(UserError, match="declares that it makes phrases, but it returned no phrases"):
        api.synthesize(speech, mover._replace(system=model.system))
