"""A model folder comes back as it was written, and any damage to it is reported in one line that names the file."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest

from cospeech.data import segments, tables
from cospeech.errors import UserError
from cospeech.workflow import model_folder

ENTRIES = {
    "system": "hsmm",
    "variant": "clusters~8,states~3",
    "actor": "ada",
    "held_out": None,
    "records": ["ada_1", "ada_2"],
    "version": "0.1.0",
    "seed": 2012,
    "speech": {"frame_s": 0.025},
    "motion_fps": 25.0,
    "continuity_weight": 0.5,
    "smoothing": {"filter": "exponential", "window": 5},
}


@pytest.fixture
def folder(tmp_path):
    """A model of two tables."""
    phrases = segments.from_starts("ada_1", [0, 40], ["rest", "left"], 100, 40.0)
    decoder = pd.DataFrame({"emission_weight": [0.25], "censoring": ["none"], "frame_s": [0.025]})
    named = {"gestures": (phrases, "segments"), "decoder": (decoder, "decoder")}
    model_folder.write(tmp_path / "model", ENTRIES, named, corpus="virtual", config_hash="0123")
    return tmp_path / "model"


def complaint(folder):
    """The message about a folder, which is one line."""
    with pytest.raises(UserError) as caught:
        model_folder.read(folder)
    (line,) = str(caught.value).splitlines()
    return line


def rewrite(folder, **entries):
    """Change entries of the card as a cospeech would that writes them."""
    card = json.loads((folder / "model.json").read_text()) | entries
    card["sha256"] = model_folder.checksum(card)
    (folder / "model.json").write_text(json.dumps(card))


def test_what_is_written_is_read_again(folder, tmp_path):
    card, found = model_folder.read(folder)
    assert ENTRIES.items() <= card.items()
    assert (card["format"], card["corpus"]) == (model_folder.FORMAT, "virtual")
    assert list(found) == ["gestures", "decoder"]
    assert found["gestures"]["label"].tolist() == ["rest", "left"]
    assert tables.read_metadata(folder / "decoder.parquet")["corpus"] == "virtual"
    assert {path.name for path in folder.iterdir()} == {"model.json", "gestures.parquet", "decoder.parquet"}


def test_the_order_and_layout_of_the_card_do_not_matter(folder):
    card = json.loads((folder / "model.json").read_text())
    (folder / "model.json").write_text(json.dumps(dict(reversed(card.items()))))
    assert model_folder.read(folder).card == card


def test_a_flipped_bit_anywhere_in_the_card_is_damage(folder):
    path = folder / "model.json"
    whole = path.read_bytes()
    for place in range(len(whole) - 1):  # the last byte ends the line
        for bit in range(8):
            changed = bytearray(whole)
            changed[place] ^= 1 << bit
            path.write_bytes(changed)
            with pytest.raises(UserError, match=r"model\.json: (damaged|has format)"):
                model_folder.read_card(folder)


@pytest.mark.parametrize("name", ["gestures", "decoder"])
def test_a_flipped_bit_anywhere_in_a_table_is_damage(folder, name):
    path = folder / f"{name}.parquet"
    whole = path.read_bytes()
    for place in np.random.default_rng(1).permutation(len(whole))[:100]:
        changed = bytearray(whole)
        changed[place] ^= 1 << (place % 8)
        path.write_bytes(changed)
        assert complaint(folder).startswith(f"{path}: damaged (its checksum is wrong)")


@pytest.mark.parametrize("name", ["model.json", "gestures.parquet", "decoder.parquet"])
def test_a_missing_or_cut_off_file_is_reported(folder, name):
    path = folder / name
    path.write_bytes(path.read_bytes()[:-20])
    assert complaint(folder).startswith(f"{path}: damaged")
    path.unlink()
    assert name in complaint(folder)
    assert complaint(folder).startswith(f"{folder}: ")


def test_a_folder_without_a_model_is_reported(tmp_path):
    assert complaint(tmp_path / "none").startswith(f"{tmp_path / 'none'}: no such model folder; correct the path")
    assert complaint(tmp_path).startswith(f"{tmp_path}: contains no model.json")
    (tmp_path / "model.json").write_text("[1, 2]")
    assert complaint(tmp_path).startswith(f"{tmp_path / 'model.json'}: damaged (not a card of a model)")


def test_another_format_is_reported_as_such(folder):
    rewrite(folder, format=model_folder.FORMAT + 1)
    assert complaint(folder) == (
        f"{folder / 'model.json'}: has format {model_folder.FORMAT + 1}, but this version of cospeech reads format "
        f"{model_folder.FORMAT}; train the model again"
    )


def test_a_table_of_an_unknown_schema_is_reported(folder):
    card = json.loads((folder / "model.json").read_text())
    listed = card["tables"] | {"decoder": card["tables"]["decoder"] | {"schema": "decoder_of_tomorrow"}}
    rewrite(folder, tables=listed)
    assert "does not know tables of schema 'decoder_of_tomorrow'; train the model again" in complaint(folder)


def test_a_model_that_was_interrupted_has_no_card(folder, tmp_path, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    shutil.rmtree(folder)
    decoder = pd.DataFrame({"emission_weight": [0.25], "censoring": ["none"], "frame_s": [0.025]})
    monkeypatch.setattr(model_folder, "checksum", interrupted)
    with pytest.raises(KeyboardInterrupt):
        model_folder.write(folder, ENTRIES, {"decoder": (decoder, "decoder")}, corpus="virtual", config_hash="0")
    assert complaint(folder).startswith(f"{folder}: contains no model.json, so it is not a complete model")
