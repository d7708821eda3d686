"""The settings of a virtual population."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """How many speakers there are, what they say, and what their voices and lips tell about them.

    Attributes
    ----------
    speakers : number of speakers.
    repetitions : how often each of them says the own name.
    others : number of names of other speakers that each of them says, as an impostor.
    shared : share of the variance of the lip movements that follows the phones of the voice, 0 to 1; the rest follows
        other phones. How a speaker articulates each phone is part of what is shared.
    own_voice : how much the voices differ in what the lips do not show, 0 (not at all) or more; 1 is the difference
        between people.
    own_lips : how much the mouths differ in what the voice does not tell, likewise.
    delay_ms : time by which the sound lags behind the lips, in milliseconds.
    sessions : number of recording sessions; the lighting changes between them.
    fps : frame rate of the films.
    film : whether speakers are filmed; if not, lip features are planted.
    sound : whether there is sound; if not, lip features and MFCC are planted.
    """

    speakers: int
    repetitions: int
    others: int
    shared: float
    own_voice: float
    own_lips: float
    delay_ms: float
    sessions: int
    fps: float
    film: bool
    sound: bool

    @property
    def delay_s(self) -> float:
        """The delay in seconds."""
        return self.delay_ms / 1000.0


def speaker_names(n: int) -> list[str]:
    """Return the names in tables of ``n`` speakers."""
    return [f"s{number:0{len(str(n))}d}" for number in range(1, n + 1)]
