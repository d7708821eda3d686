"""Keywords that pocketsphinx recognises, in a process of its own, which the engine never waits for."""

import os
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

from cospeech.errors import UserError
from cospeech.formats import sound
from cospeech.live import recogniser, spotting
from cospeech.live.recogniser import Recogniser

SENTENCE = Path("../shared/data/librivox/sense_and_sensibility_01_austen_64kb-0870.wav")
SAID = ("dashwood", "consider", "prudently", "power")
UNSAID = ("woman", "selfish", "respectable")


@pytest.fixture
def sentence():
    if not SENTENCE.is_file():
        pytest.skip(f"no recording {SENTENCE}")
    return sound.read(SENTENCE).samples


@pytest.mark.recorded
def test_words_of_a_sentence_are_found_in_their_order_and_others_are_not(sentence):
    words = (*UNSAID, *SAID)
    chunks = [sentence[first : first + 400] for first in range(0, len(sentence), 400)]
    assert tuple(spotting.spot(spotting.decoder(words), words, iter(chunks))) == SAID


@pytest.mark.recorded
def test_a_process_recognises_words_of_sound_at_another_rate(sentence, monkeypatch):
    """Every sample three times is the sentence at 48 kHz, but for what is above the range of the model."""
    monkeypatch.setattr(recogniser, "MOST_BYTES", 10**7)  # it hears the sentence faster than it is spoken
    said = []
    heard = Recogniser(("Consider", "Prudently"), 48000, said.append)
    spoken, found = np.repeat(sentence, 3), []
    for first in range(0, len(spoken), 1200):
        heard.hear(spoken[first : first + 1200])
        found += heard.changes()
    os.set_blocking(heard._process.stdin.fileno(), True)
    heard.hear(np.zeros(48000))
    heard._process.stdin.close()
    heard._process.wait()
    found += heard.changes()
    heard.close()
    assert [tuple(change) for change in found] == [("keyword", "Consider"), ("keyword", "Prudently")]
    assert not said


def test_the_engine_does_not_wait_for_a_recogniser_that_is_too_slow():
    said = []
    heard = Recogniser(("woman",), 16000, said.append)
    os.kill(heard._process.pid, signal.SIGSTOP)
    for _ in range(600):
        heard.hear(np.zeros(400))
        assert list(heard.changes()) == []
    assert len(heard._sound) <= recogniser.MOST_BYTES + 1600
    os.kill(heard._process.pid, signal.SIGCONT)
    heard.close()
    assert said == ["keywords: the machine is too slow to recognise all words; some are missed"]


def test_a_recogniser_that_stops_is_reported_once():
    said = []
    heard = Recogniser(("woman",), 16000, said.append)
    heard._process.kill()
    heard._process.wait()
    for _ in range(3):
        heard.hear(np.zeros(400))
        assert list(heard.changes()) == []
    heard.close()
    assert said == ["keywords: the recogniser has stopped; words are no longer recognised"]


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ((), "the model has no keywords; add some with 'cospeech library --keywords'"),
        (("woman", "xyzzy"), "keyword 'xyzzy': 'xyzzy' is not in the English dictionary of pocketsphinx; "),
    ],
)
def test_words_that_cannot_be_recognised_take_one_line(words, complaint):
    with pytest.raises(UserError) as error:
        Recogniser(words, 16000, print)
    assert str(error.value).startswith(f"--keywords-from pocketsphinx: {complaint}")


def test_without_the_package_one_line_says_how_to_install_it(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pocketsphinx", None)
    spotting.main(["16000", "woman"])
    assert capsys.readouterr().out == "the package pocketsphinx is not installed; pip install 'cospeech[keywords]'\n"
