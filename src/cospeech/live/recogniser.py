"""Keywords in speech, which are recognised by another process, so that motion never waits for it.

The recogniser is pocketsphinx, a descendant of the one of Levine et al. 2010, 9.2, with the model of American English
that its package contains. It does not transcribe the speech, but looks for the keywords only. In the five LibriVox
sentences of the tests, it finds 20 of the 25 words of five letters or more, with 3 false alarms.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence

from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.live.changes import Change

MOST_BYTES = 4 * 48000 * 2
"""Sound that may wait for the recogniser; more of it is lost, as words that come late are of no use."""

STOP_S = 2.0
"""Time that the recogniser has to end, in seconds."""


class Recogniser:
    """Recognises keywords in the sound that it hears; see ``changes.Listener``.

    Parameters
    ----------
    words : the keywords.
    rate_hz : sampling rate of the sound in Hz.
    note : says in one line what the user should know.

    Raises
    ------
    UserError : if pocketsphinx is not installed, there is no keyword, or its dictionary lacks one of the words.
    """

    def __init__(self, words: Sequence[str], rate_hz: int, note: Callable[[str], None]) -> None:
        if not words:
            raise UserError(
                "--keywords-from pocketsphinx: the model has no keywords; add some with 'cospeech library --keywords'"
            )
        self._note = note
        self._process = subprocess.Popen(
            [sys.executable, "-m", "cospeech.live.spotting", str(rate_hz), *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C is for the engine, which ends the recogniser
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._into, self._from = self._process.stdin.fileno(), self._process.stdout.fileno()
        answer = self._process.stdout.readline().decode().strip()
        if answer != "ready":
            self.close()
            raise UserError(f"--keywords-from pocketsphinx: {answer or 'the recogniser did not start'}")
        os.set_blocking(self._into, False)
        os.set_blocking(self._from, False)
        self._sound, self._answers = bytearray(), b""
        self._late = self._ended = False

    def hear(self, samples: Floats) -> None:
        """Pass samples (n,) to the recogniser, without waiting for it."""
        if self._ended:
            return
        if len(self._sound) < MOST_BYTES:
            self._sound += samples.astype("<f4").tobytes()
        elif not self._late:
            self._late = True
            self._note("keywords: the machine is too slow to recognise all words; some are missed")
        try:
            del self._sound[: os.write(self._into, self._sound)]
        except BlockingIOError:
            return
        except BrokenPipeError:
            self._ended = True
            self._note("keywords: the recogniser has stopped; words are no longer recognised")

    def changes(self) -> Iterator[Change]:
        """Yield the keywords that have been recognised."""
        try:
            self._answers += os.read(self._from, 4096)
        except BlockingIOError:
            return
        *words, self._answers = self._answers.split(b"\n")
        for word in words:
            yield Change("keyword", word.decode())

    def close(self) -> None:
        """End the recogniser."""
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()
        try:
            self._process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
