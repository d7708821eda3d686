"""Clips and their audio and lip features, frame by frame at 100 Hz."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats, Integers
from cospeech.identity.lips import at_rate
from cospeech.markov.word_hmm import Clips

RATE_HZ = 100.0
"""Rate of audio frames, to which lip features are interpolated (Sargin 2006, 2.2)."""


class Features(NamedTuple):
    """The features of all clips, below one another.

    Attributes
    ----------
    clips : the table ``clips``, one row per clip in the order of the features.
    begin, length : (C,) first frame of each clip, and its number of frames.
    audio, lips : (T, N_A) and (T, N_L).
    """

    clips: pd.DataFrame
    begin: Integers
    length: Integers
    audio: Floats
    lips: Floats

    def stream(self, frames: Floats) -> Clips:
        """Return frames (T, D) of all clips as word models take them."""
        return Clips(np.ascontiguousarray(frames), self.begin, self.length)

    def rows(self, clips: Integers) -> Integers:
        """Return the indices of the frames of some clips."""
        parts = [np.arange(self.begin[clip], self.begin[clip] + self.length[clip]) for clip in clips]
        return np.concatenate(parts) if parts else np.zeros(0, dtype=np.int64)

    def chosen(self, clips: Integers) -> Features:
        """Return some clips, given by index."""
        return joined(
            self.clips.iloc[clips],
            [self.audio[self.begin[clip] : self.begin[clip] + self.length[clip]] for clip in clips],
            [self.lips[self.begin[clip] : self.begin[clip] + self.length[clip]] for clip in clips],
        )


def joined(clips: pd.DataFrame, audio: list[Floats], lips: list[Floats]) -> Features:
    """Return the features of clips from those of each; audio and lips of a clip have the same number of frames."""
    length = np.array([len(frames) for frames in audio], dtype=np.int64)
    begin = np.cumsum(length) - length
    return Features(clips.reset_index(drop=True), begin, length, np.concatenate(audio), np.concatenate(lips))


def shifted(features: Features, shift: int) -> Features:
    """Return audio frame k + ``shift`` next to lip frame k, where a clip has both (Sargin 2006, 2.2)."""
    audio, lips = max(shift, 0), max(-shift, 0)
    length = np.maximum(features.length - abs(shift), 0)
    pairs = list(zip(features.begin, length, strict=True))
    return joined(
        features.clips,
        [features.audio[begin + audio : begin + audio + n] for begin, n in pairs],
        [features.lips[begin + lips : begin + lips + n] for begin, n in pairs],
    )


def of_tables(clips: pd.DataFrame, audio: pd.DataFrame, lips: pd.DataFrame) -> Features:
    """Return the features of clips, the lips at the times of the audio frames and without their mean over the clip.

    The mean shows a face in the light of a lamp, whatever is said. Impostors are registered speakers who say the name
    of another one: by their faces they would be accepted (see docs/identity.md).

    Parameters
    ----------
    clips : the table ``clips``. Clips without features of both kinds are left out.
    audio, lips : tables ``mfcc`` and ``lips`` of these clips.
    """
    names = [name for name in audio.columns if name.startswith("c") and name[1:].isdigit()]
    heard = {str(clip): own for clip, own in audio.groupby("clip", sort=False)}
    seen = {str(clip): own for clip, own in lips.groupby("clip", sort=False)}
    known = clips[clips["clip"].isin(heard) & clips["clip"].isin(seen)]
    return joined(
        known,
        [heard[clip][names].to_numpy(dtype=float) for clip in known["clip"]],
        [centred(at_rate(seen[clip], heard[clip]["time_s"].to_numpy(dtype=float))) for clip in known["clip"]],
    )


def centred(frames: Floats) -> Floats:
    """Return frames (T, D) without their mean."""
    return frames - frames.mean(axis=0)


def of_lists(clips: list[pd.DataFrame], audio: list[pd.DataFrame], lips: list[pd.DataFrame]) -> Features:
    """Return the features of clips from tables in parts; see ``of_tables``."""
    return of_tables(
        pd.concat(clips, ignore_index=True), pd.concat(audio, ignore_index=True), pd.concat(lips, ignore_index=True)
    )
