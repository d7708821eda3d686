"""Keys of the terminal, on a pseudo-terminal of our own."""

import os
import pty
import termios

import pytest

from cospeech.errors import UserError
from cospeech.live.keys import Keys, bindings, line
from cospeech.synthesis.live import Controls


@pytest.fixture
def terminal():
    ours, theirs = pty.openpty()
    yield ours, os.ttyname(theirs)
    os.close(ours)
    os.close(theirs)


def changes_of(keys, key):
    return [tuple(change) for change in keys[key].changes]


def test_digits_are_keywords_and_letters_are_styles():
    keys = bindings(Controls(("left", "right"), ("energetic", "calm")))
    assert line(keys) == "keys: 1 left, 2 right, e energetic, c calm, 0 neutral"
    assert changes_of(keys, "2") == [("keyword", "right")]
    assert changes_of(keys, "e") == [("style:calm", 0.0), ("style:energetic", 1.0)]
    assert changes_of(keys, "0") == [("style:energetic", 0.0), ("style:calm", 0.0)]


def test_every_style_has_a_letter_of_its_own_and_further_keywords_have_none():
    keys = bindings(Controls(tuple(f"w{n}" for n in range(12)), ("calm", "cold", "c")))
    assert [key for key in keys if key.isdigit() and key != "0"] == [*"123456789"]
    assert {key: keys[key].title for key in keys if key.isalpha()} == {"c": "calm", "o": "cold", "a": "c"}


def test_a_model_without_anything_to_call_for_takes_one_line():
    with pytest.raises(UserError, match=r"^--keys: the model has no keywords and no styles; .* leave out --keys$"):
        bindings(Controls())


def test_pressed_keys_become_changes_and_the_terminal_is_restored(terminal):
    ours, name = terminal
    before = os.open(name, os.O_RDWR | os.O_NOCTTY)
    settings = termios.tcgetattr(before)
    keys = Keys(bindings(Controls(("left", "right"), ("calm",))), name)
    assert list(keys.changes()) == []
    os.write(ours, b"1x2")
    pressed = []
    while len(pressed) < 2:
        pressed += keys.changes()
    assert [tuple(change) for change in pressed] == [("keyword", "left"), ("keyword", "right")]
    assert termios.tcgetattr(before)[3] != settings[3]
    keys.close()
    assert termios.tcgetattr(before) == settings
    os.close(before)


def test_no_terminal_takes_one_line(tmp_path):
    with pytest.raises(UserError, match=r"^--keys: there is no terminal to listen to \(.*\); leave out --keys$"):
        Keys({}, str(tmp_path / "none"))
