"""Settings of the route directions. Nothing here loads numpy, as the Snakefile imports it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """The section ``studio.directions`` of a configuration.

    Attributes
    ----------
    voices : voices of Praat's synthesiser.
    answers : number of answers of each voice.
    accent_st : mean height of a pitch accent, in semitones.
    ripple_st : standard deviation of the pitch of all syllables, in semitones.
    accents_with_head, keywords_with_hand : share of pitch accents and keywords that a gesture accompanies.
    head_lag_s : standard deviation of the onset of head gestures relative to that of their accents.
    """

    voices: list[str]
    answers: int
    accent_st: float
    ripple_st: float
    accents_with_head: float
    keywords_with_hand: float
    head_lag_s: float

    def portion(self, number: int) -> str:
        """Return what an answer is for: the last fifth is tested (3.2.2), and every fifth of the others validated."""
        if number >= 0.8 * self.answers:
            return "test"
        return "validation" if number % 5 == 4 else "training"
