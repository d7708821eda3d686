"""Changes of what a performer does: where they come from, and how they are made without holding up the motion."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple, Protocol

from cospeech.errors import UserError


class Change(NamedTuple):
    """A change: ``style:<name>`` with a number, or ``keyword`` with a word (see ``performing.Performer.prepare``)."""

    name: str
    value: float | str


class Listener(Protocol):
    """Where changes come from."""

    def changes(self) -> Iterator[Change]:
        """Yield the changes that have arrived, without waiting for any.

        Raises
        ------
        UserError : if something else has arrived. The next call continues with what came after it.
        """

    def close(self) -> None:
        """Stop listening."""


Make = Callable[[], None]
"""Makes a change that has been prepared; takes no time."""


class Changing:
    """Makes changes while motion is made.

    A change of style takes half a second to prepare. This is done in a thread, and the style changes when it is
    ready. The gesture of a keyword is called for at once. Of several changes of one style that arrive meanwhile,
    only the last one is made.

    Parameters
    ----------
    prepare : see ``performing.Performer``.
    note : says in one line what is wrong with a change.
    """

    def __init__(self, prepare: Callable[[str, float | str], Make], note: Callable[[str], None]) -> None:
        self._prepare, self._note = prepare, note
        self._worker = ThreadPoolExecutor(1, "change of style")
        self._waiting: dict[str, float] = {}
        self._running: Future[Make] | None = None

    def listen(self, listeners: Iterable[Listener]) -> None:
        """Take the changes that have arrived, and make those that are ready."""
        for listener in listeners:
            try:
                for change in listener.changes():
                    self._take(change)
            except UserError as error:
                self._note(str(error))
        if self._running is not None and self._running.done():
            self._make(self._running.result)
            self._running = None
        if self._running is None and self._waiting:
            name = next(iter(self._waiting))
            self._running = self._worker.submit(self._prepare, name, self._waiting.pop(name))

    def _take(self, change: Change) -> None:
        if isinstance(change.value, str):
            self._make(lambda: self._prepare(*change))
        else:
            self._waiting[change.name] = change.value

    def _make(self, prepared: Callable[[], Make]) -> None:
        try:
            prepared()()
        except UserError as error:
            self._note(str(error))

    def close(self) -> None:
        """Give up what is not ready."""
        self._worker.shutdown(cancel_futures=True)
