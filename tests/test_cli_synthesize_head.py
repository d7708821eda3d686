"""``cospeech synthesize`` with models that move the head alone."""

import shutil

import av
import numpy as np
import pandas as pd
import pytest

from cospeech import __version__, api, cli
from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.formats import bvh
from cospeech.motion import head, skeleton
from cospeech.speech import melody
from cospeech.synthesis.registry import installed
from cospeech.synthesis.session import Session
from cospeech.synthesis.training import head_fold
from cospeech.workflow import model_folder

FPS = 25.0


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """The folder of a model whose head keeps the mean angles of two records."""
    rng = np.random.default_rng(0)
    heads = {name: head.table(rng.normal([4.0, 8.0, -3.0], 2.0, (500, 3)), FPS) for name in ("a", "b")}
    melodies = {name: melody.table(name, rng.normal(150, 9, 2000), rng.normal(-30, 2, 2000), 0) for name in heads}
    training, _ = head_fold("eda", None, melodies, heads)
    system = installed("head_mean")
    made = Session(training, {}, {}).tables(system)
    card = dict.fromkeys(model_folder.ENTRIES) | {
        "system": system.name, "variant": "main", "actor": "eda", "records": list(heads), "version": __version__,
        "seed": 1, "speech": api.default_settings()["speech"], "motion_fps": FPS,
    }  # fmt: skip
    del card["corpus"]
    folder = tmp_path_factory.mktemp("model")
    named = {name: (made[name], schema) for name, schema in system.table_schemas.items()}
    model_folder.write(folder, card, named, corpus="virtual", config_hash="0")
    return folder


@pytest.fixture
def call(recordings, tmp_path, monkeypatch, model):
    shutil.copy(recordings / "speech.wav", tmp_path)
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: cli.main(["synthesize", "speech.wav", "--model", str(model), *map(str, arguments)])


def test_a_head_is_written_as_body_table_text_and_video(call, tmp_path):
    assert call() == 0
    written = sorted(path.name for path in tmp_path.glob("speech.*"))
    assert written == ["speech.bvh", "speech.head.csv", "speech.head.parquet", "speech.mp4", "speech.wav"]
    angles = tables.read(tmp_path / "speech.head.parquet", "head")
    assert len(angles) == 250  # ten seconds
    text = pd.read_csv(tmp_path / "speech.head.csv")
    np.testing.assert_allclose(text[head.COLUMNS], angles[head.COLUMNS], atol=1e-6)
    assert len(bvh.read(tmp_path / "speech.bvh").rotations) == 250
    with av.open(str(tmp_path / "speech.mp4")) as video:
        assert video.streams.video[0].frames == 250


def test_the_head_is_put_onto_a_given_body(call, tmp_path):
    body = skeleton.standing(250, FPS).assign(left_arm_x_deg=-40.0)
    tables.write(body, tmp_path / "body.parquet", "motion", corpus="virtual", config_hash="0")
    assert call("--body", "body.parquet", "--format", "bvh,csv") == 0
    text = pd.read_csv(tmp_path / "speech.head.csv")
    assert text["y_deg"].mean() == pytest.approx(8.0, abs=0.5)


def test_formats_of_bodies_are_refused(call, capsys):
    with pytest.raises(SystemExit):
        call("--format", "textgrid")
    assert "this model moves the head alone; it can write bvh, table, csv, mp4" in capsys.readouterr().err


def test_each_kind_of_model_has_its_own_door(model):
    with pytest.raises(UserError, match=r"moves the head alone; see api\.load_head_model"):
        api.load_model(model)
    with pytest.raises(UserError, match=r"which makes phrases; see api\.load_model"):
        api.load_head_model(api.BUNDLED)
    performance = api.synthesize_head(0.1 * np.sin(np.arange(32000) / 10), api.load_head_model(model))
    assert len(performance.head) == 50
