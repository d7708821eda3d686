"""Times of words: what is read from Praat and CSV, and what is refused."""

import pandas as pd
import pytest

from cospeech.corpus import words
from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.formats import textgrid

SPOKEN = [(0.2, 0.5, "turn"), (0.5, 0.9, "left")]


def test_words_are_read_in_order_of_time_whatever_the_file(tmp_path):
    textgrid.write(tmp_path / "a.TextGrid", "words", SPOKEN, 2.0)
    (tmp_path / "b.csv").write_text("word;start_s;end_s\nleft;0,5;0,9\nturn;0,2;0,5\n")
    expected = pd.DataFrame([("r", *row) for row in SPOKEN], columns=["record", "start_s", "end_s", "word"])
    for name in ("a.TextGrid", "b.csv"):
        found = words.read(tmp_path / name, "r")
        tables.validate(found, "words", name)
        pd.testing.assert_frame_equal(found, expected, check_dtype=False)


def tiers(path, *named):
    """Write a TextGrid of several tiers."""
    rows = "".join(f'"IntervalTier" "{name}" 0 1 1 0 1 "{label}" ' for name, label in named)
    path.write_text(f'File type = "ooTextFile"\nObject class = "TextGrid"\n0 1 <exists> {len(named)} {rows}\n')


def test_the_tier_of_words_is_taken_from_several(tmp_path):
    tiers(tmp_path / "a.TextGrid", ("phones", "l"), ("words", "left"))
    assert list(words.read(tmp_path / "a.TextGrid", "r")["word"]) == ["left"]
    tiers(tmp_path / "b.TextGrid", ("phones", "l"), ("speaker", "left"))
    with pytest.raises(UserError, match=r"b.TextGrid: has the tiers phones, speaker; rename the one with the words"):
        words.read(tmp_path / "b.TextGrid", "r")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("word,start_s,end_s\n", "contains no word"),
        ("word,start_s\nleft,0.5\n", "has no column 'end_s'"),
        ("word,start_s,end_s\nleft,0.5,0.4\n", "line 2: 'left' at 0.500-0.400 s; a word must"),
        ("word,start_s,end_s\nleft,,0.4\n", "line 2 lacks a time or a word"),
    ],
)
def test_wrong_files_are_named_with_the_line(tmp_path, text, message):
    (tmp_path / "w.csv").write_text(text)
    with pytest.raises(UserError, match=message):
        words.read(tmp_path / "w.csv", "r")


def test_a_missing_file_and_an_unknown_format_are_told_apart(tmp_path):
    with pytest.raises(UserError, match=r"no such file"):
        words.read(tmp_path / "w.csv", "r")
    with pytest.raises(UserError, match=r"unknown format of words; use .TextGrid, .csv or .tsv"):
        words.read(tmp_path / "w.docx", "r")
