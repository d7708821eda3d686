"""Keys of the terminal that call for keywords and styles."""

from __future__ import annotations

import os
import string
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from cospeech.errors import UserError
from cospeech.live.changes import Change
from cospeech.synthesis.live import Controls

TERMINAL = "/dev/tty"
"""The terminal that controls the process; standard input may be a pipe with sound."""

NEUTRAL = "0"
"""The key of the neutral style."""


class Key(NamedTuple):
    """What a key stands for, in words, and the changes that it makes."""

    title: str
    changes: tuple[Change, ...]


def bindings(offered: Controls) -> dict[str, Key]:
    """Return the keys of a model.

    The digits from 1 on call for its keywords, as far as they suffice. The first letter of the name of a style that
    is not taken yet makes the motion express this style fully; ``NEUTRAL`` ends it.

    Raises
    ------
    UserError : if the model has neither keywords nor styles.
    """
    if not (offered.keywords or offered.styles):
        raise UserError(
            "--keys: the model has no keywords and no styles; 'cospeech library --keywords' adds keywords, "
            "or leave out --keys"
        )
    keys = {
        digit: Key(word, (Change("keyword", word),))
        for digit, word in zip(string.digits[1:], offered.keywords, strict=False)
    }
    for name in offered.styles:
        letter = next((letter for letter in name.lower() + string.ascii_lowercase if letter not in keys), None)
        if letter is not None:
            others = [Change(f"style:{other}", 0.0) for other in offered.styles if other != name]
            keys[letter] = Key(name, (*others, Change(f"style:{name}", 1.0)))
    if offered.styles:
        keys[NEUTRAL] = Key("neutral", tuple(Change(f"style:{name}", 0.0) for name in offered.styles))
    return keys


def line(keys: Mapping[str, Key]) -> str:
    """Return one line that says what the keys are for."""
    return "keys: " + ", ".join(f"{key} {made.title}" for key, made in keys.items())


class Keys:
    """Listens to the keys of the terminal, which shows them no longer; see ``changes.Listener``.

    Ctrl-C and other signals work as before. Keys without a meaning are ignored.

    Parameters
    ----------
    keys : what each key stands for.
    terminal : the device to listen to.

    Raises
    ------
    UserError : if there is no terminal.
    """

    def __init__(self, keys: Mapping[str, Key], terminal: str = TERMINAL) -> None:
        self._keys = keys
        try:
            import termios
            import tty
        except ImportError as error:
            raise UserError("--keys: this system has no terminal to listen to; use --osc instead") from error
        try:
            self._terminal = os.open(terminal, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY)
        except OSError as error:
            raise UserError(
                f"--keys: there is no terminal to listen to ({error.strerror}); leave out --keys"
            ) from error
        self._before = termios.tcgetattr(self._terminal)
        tty.setcbreak(self._terminal)

    def changes(self) -> Iterator[Change]:
        """Yield the changes of the keys that were pressed."""
        try:
            pressed = os.read(self._terminal, 1000)
        except OSError:  # none was pressed, or the terminal is gone
            return
        for key in pressed.decode("ascii", "replace"):
            if key in self._keys:
                yield from self._keys[key].changes

    def close(self) -> None:
        """Let the terminal show keys again."""
        import termios

        termios.tcsetattr(self._terminal, termios.TCSADRAIN, self._before)
        os.close(self._terminal)
