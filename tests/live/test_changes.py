"""Changes while motion is made: in the order in which they come, the last one of each style, and none lost."""

from concurrent.futures import Future

import pytest
from stand_in import AtOnce

from cospeech.errors import UserError
from cospeech.live import changes
from cospeech.live.changes import Change, Changing


class Listening:
    """Yields what it is given; an error in it is raised."""

    def __init__(self, *arrived):
        self.arrived = [*arrived]

    def changes(self):
        while self.arrived:
            change = self.arrived.pop(0)
            if isinstance(change, UserError):
                raise change
            yield change

    def close(self):
        pass


class Later(AtOnce):
    """Takes the place of a thread, and does its work only when it is told to."""

    def __init__(self, *_):
        self.begun = []

    def submit(self, work, *arguments):
        made = Future()
        self.begun.append((made, work, arguments))
        return made

    def work(self):
        made, work, arguments = self.begun.pop(0)
        made.set_result(work(*arguments))


@pytest.fixture
def made():
    return []


@pytest.fixture
def said():
    return []


@pytest.fixture
def changing(made, said, monkeypatch):
    monkeypatch.setattr(changes, "ThreadPoolExecutor", Later)

    def prepare(name, value):
        if value == "unknown":
            raise UserError("no such keyword")
        return lambda: made.append((name, value))

    return Changing(prepare, said.append)


def test_words_are_taken_at_once_and_styles_when_they_are_ready(changing, made):
    changing.listen([Listening(Change("style:calm", 0.5), Change("keyword", "left"))])
    assert made == [("keyword", "left")]
    changing.listen([])
    assert made == [("keyword", "left")]
    changing._worker.work()
    assert made == [("keyword", "left")]  # only the engine's own thread makes changes
    changing.listen([])
    assert made == [("keyword", "left"), ("style:calm", 0.5)]


def test_only_the_last_value_of_a_style_is_made_if_several_arrive_in_the_meantime(changing, made):
    changing.listen([Listening(Change("style:calm", 0.1))])
    changing.listen([Listening(*(Change("style:calm", value) for value in (0.2, 0.3, 0.4)))])
    changing.listen([Listening(Change("style:energetic", 1.0))])
    for _ in range(3):
        changing._worker.work()
        changing.listen([])
    assert made == [("style:calm", 0.1), ("style:calm", 0.4), ("style:energetic", 1.0)]
    assert not changing._worker.begun


def test_what_is_wrong_is_said_and_the_rest_is_made(changing, made, said):
    wrong, other = UserError("OSC: not a message"), Change("keyword", "right")
    listening = Listening(Change("keyword", "unknown"), Change("keyword", "left"), wrong, other)
    changing.listen([listening])
    changing.listen([listening])
    assert said == ["no such keyword", "OSC: not a message"]
    assert made == [("keyword", "left"), ("keyword", "right")]


def test_a_style_that_cannot_be_prepared_is_reported(said, monkeypatch):
    monkeypatch.setattr(changes, "ThreadPoolExecutor", AtOnce)

    def prepare(name, value):
        raise UserError(f"no {name}")

    changing = Changing(prepare, said.append)
    changing.listen([Listening(Change("style:sleepy", 1.0))])
    changing.listen([])
    assert said == ["no style:sleepy"]
