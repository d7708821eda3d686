"""Heads that move alone while somebody speaks: the same as of a whole melody, on a body for avatars, and recorded."""

import os
import signal
import socket
import threading
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from stand_in import Chunks, Sink, run

from cospeech import __version__, api, cli
from cospeech.api import HeadModel
from cospeech.data import tables
from cospeech.formats import bvh, sound
from cospeech.live import engine, recording
from cospeech.live.heads import OnBody
from cospeech.live.recording import Recorder
from cospeech.motion import head, library, skeleton
from cospeech.speech import melody
from cospeech.synthesis import live
from cospeech.synthesis.head import SETTINGS, SYSTEMS
from cospeech.synthesis.head import model as head_model
from cospeech.synthesis.interface import Speech, Training
from cospeech.synthesis.session import Trained, method_of
from cospeech.workflow import model_folder

FPS, SEED = 25.0, 3
DRIVEN = {system.name: system for system in SYSTEMS if system.live}
FEW = {
    "restarts": 1, "iterations": 3, "head_patterns": 2, "melody_patterns": 2, "joint_patterns": 2, "iohmm_states": 3,
    "look_ahead_frames": 6, "melody_lag_s": 0.1,
}  # fmt: skip


@pytest.fixture(scope="module")
def models():
    """A model of each live system, trained on a minute of noise."""
    rng = np.random.default_rng(0)
    noise = np.cumsum(rng.standard_normal((1500, 3)), axis=0)
    heads = {"a": head.table(5.0 * np.sin(noise / 9.0), FPS)}
    spoken = {"a": melody.table("a", 150.0 + rng.normal(0, 9.0, 6000), rng.normal(-30.0, 2.0, 6000), 0)}
    training = Training("eda", 0.025, (), (), {}, {}, melodies=spoken, heads=heads)
    trained = head_model.train(training, SETTINGS | FEW)
    card = {"speech": {"frame_s": 0.025}, "motion_fps": FPS, "seed": SEED, "corpus": "virtual"}
    return {name: HeadModel(card, system, Trained(method_of(system), trained)) for name, system in DRIVEN.items()}


def offline(model, samples):
    """The angles (T, 3) that a model makes of the melody of all samples at once."""
    hearing = engine.listening(model, 16000)
    heard = [one.melody for one in (*hearing.push(samples), *hearing.finish())]
    spoken = pd.DataFrame(np.concatenate(heard), columns=list(live.MELODY))
    n_frames = round(len(samples) / 16000 * FPS)
    speech = Speech(
        "stream", 0.01, len(spoken), melody=spoken.assign(time_s=0.005), motion_fps=FPS, n_motion_frames=n_frames
    )
    made = live.by_steps(model.trained.method, "head", model.trained.model, speech, SEED).head
    return made[list(live.ANGLES)].to_numpy()


@pytest.mark.parametrize("name", DRIVEN)
def test_live_angles_are_those_of_the_whole_melody(models, samples, name):
    spoken = samples[:98_765]
    expected = offline(models[name], spoken)
    assert len(expected) == 154
    assert (expected.std(axis=0) > 0.5).all()
    for size in (160, 777, 100_000):
        _, frames = run(models[name], Chunks(spoken, size), seed=SEED, fps=FPS)
        np.testing.assert_array_equal(frames, expected)


def test_single_samples_are_heard(models, samples):
    spoken = samples[40_000:48_000]
    _, frames = run(models["head"], Chunks(spoken, 1), seed=SEED, fps=FPS)
    np.testing.assert_array_equal(frames, offline(models["head"], spoken))


def test_sound_shorter_than_a_frame_moves_nothing(models, samples):
    _, frames = run(models["head"], Chunks(samples[:100], 50), fps=FPS)
    assert len(frames) == 0


def test_a_recording_has_the_angles_as_table_as_text_and_on_a_body(models, samples, tmp_path):
    model = models["iohmm"]
    recorders = [
        Recorder(tmp_path / f"a.{end}", None, FPS, model.card, False, print) for end in ("parquet", "csv", "bvh")
    ]
    _, frames = run(model, Chunks(samples[:48_000], 400), recorders, seed=SEED, fps=FPS)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.bvh", "a.csv", "a.parquet"]
    table = tables.read(tmp_path / "a.parquet", "head")
    pd.testing.assert_frame_equal(table, live.head_table(frames, FPS))
    np.testing.assert_allclose(pd.read_csv(tmp_path / "a.csv")[head.COLUMNS], frames, atol=1e-6)
    bvh.write(head.moved(skeleton.standing(len(table), FPS), table), tmp_path / "expected.bvh")
    assert (tmp_path / "a.bvh").read_bytes() == (tmp_path / "expected.bvh").read_bytes()


def test_an_interrupted_recording_is_recovered(models, tmp_path):
    recorder = Recorder(tmp_path / "a.csv", None, FPS, models["head"].card, False, print)
    for frame in range(5):
        recorder.show(frame, 0.0, np.arange(3.0) + frame)
    path = recording.recover(Path(f"{tmp_path / 'a.csv'}.recording"), False)
    np.testing.assert_array_equal(pd.read_csv(path)[head.COLUMNS], np.arange(3.0) + np.arange(5.0)[:, None])


def test_neck_and_head_take_one_half_each_of_the_rotation():
    angles = np.random.default_rng(1).uniform(-60.0, 60.0, (50, 3))
    sink = Sink()
    on_body = OnBody(sink)
    for frame, own in enumerate(angles):
        on_body.show(frame, 0.0, own)
    expected = library.from_motion(head.moved(skeleton.standing(50, FPS), head.table(angles, FPS))).frames
    found = np.array(sink.frames)
    signs = np.sign((found[:, 3:] * expected[:, 3:]).reshape(50, -1, 4).sum(axis=2))  # q and -q are one rotation
    np.testing.assert_allclose(found[:, 3:] * np.repeat(signs, 4, axis=1), expected[:, 3:], atol=1e-9)
    on_body.close()
    assert sink.closed


@pytest.fixture
def folder(models, tmp_path, monkeypatch):
    """The folder of the model of ``head``, in an empty working directory."""
    model = models["head"]
    made = model.trained.method.to_tables(model.trained.model)
    card = dict.fromkeys(model_folder.ENTRIES) | {
        "system": "head", "variant": "main", "actor": "eda", "records": ["a"], "version": __version__, "seed": SEED,
        "speech": api.default_settings()["speech"], "motion_fps": FPS,
    }  # fmt: skip
    del card["corpus"]
    named = {name: (made[name], schema) for name, schema in model.system.table_schemas.items()}
    model_folder.write(tmp_path / "model", card, named, corpus="virtual", config_hash="0")
    monkeypatch.chdir(tmp_path)
    return "model"


def test_the_command_completes_its_files_when_it_is_stopped_and_sends_the_head(folder, samples, capsys):
    ends = os.pipe()
    os.write(ends[1], sound.to_16_bit(samples[:32_000]).astype("<i2").tobytes())
    before = os.dup(0)
    os.dup2(ends[0], 0)
    packets = []

    def interrupt():
        try:
            packets.append(receiver.recv(2000))
        finally:
            os.kill(os.getpid(), signal.SIGINT)

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(30.0)
        port = receiver.getsockname()[1]
        thread = threading.Thread(target=interrupt)
        thread.start()
        try:
            asked = ["--model", folder, "--vmc", f"127.0.0.1:{port}", "--record", "a.bvh", "--record", "a.csv"]
            assert cli.main(["live", *asked]) == 0
        finally:
            os.dup2(before, 0)
            for end in (before, *ends):
                os.close(end)
        thread.join()
    assert b"/VMC/Ext/Bone/Pos" in packets[0]
    assert capsys.readouterr().out.splitlines() == ["a.bvh", "a.csv"]
    assert sorted(path.name for path in Path().iterdir()) == ["a.bvh", "a.csv", "model"]
    text = pd.read_csv("a.csv")
    assert len(bvh.read("a.bvh").rotations) == len(text) > 10
