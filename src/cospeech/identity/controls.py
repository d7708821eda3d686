"""What a canonical transform is trained on: lips that belong to the voice, or, as a control, lips that do not.

Word models are always trained and tested with the lips that belong to the voice. Only the transform changes, in the
same number of dimensions. What such a control reaches, too, is not owed to a relation of voice and lips. Canonical
components are also white, which by itself suits Gaussians with diagonal covariance.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.data.rng import random_source
from cospeech.identity import canonical
from cospeech.identity.features import Features

PAIRED = "paired"
CEILING = "tested clips too"

CONTROLS = (
    "another speaker",
    "another name",
    "scrambled",
    "noise",
    "whitened",
    "audio alone",
)
"""The controls, in the order of every table.

Lips of another speaker who says the same name; of the same speaker who says another name; in a random order of time;
noise with the spectrum of the lip features; principal components of each side alone; and in place of each lip
component the next principal component of the voice, so that as many parameters are trained from audio alone.
"""


class Affine(NamedTuple):
    """A transform of features (D,) into components (N,): ``mean`` (D,), subtracted first, and ``basis`` (N, D)."""

    mean: Floats
    basis: Floats

    def __call__(self, frames: Floats) -> Floats:
        """Return the components (T, N) of frames (T, D)."""
        return np.ascontiguousarray((frames - self.mean) @ self.basis.T)


class Pairs(NamedTuple):
    """Transforms into N pairs of components.

    Attributes
    ----------
    first : of the voice.
    second : of the lips, or again of the voice.
    of_audio : whether the second components are also those of the voice.
    correlations : (N,) canonical correlations, in decreasing order; empty for principal components.
    """

    first: Affine
    second: Affine
    of_audio: bool
    correlations: Floats

    def components(self, features: Features) -> tuple[Floats, Floats]:
        """Return the first and second components of all frames, (T, N) each."""
        return self.first(features.audio), self.second(features.audio if self.of_audio else features.lips)


def paired(features: Features, training: Integers, regularisation: float) -> Pairs:
    """Return the canonical transform of the voices and lips of some clips.

    Parameters
    ----------
    features : of all clips, synchronised.
    training : index of the clips that the transform is trained on.
    regularisation : see ``canonical.fit``.
    """
    rows = features.rows(training)
    return _of_transform(canonical.fit(features.audio[rows], features.lips[rows], regularisation))


def control(features: Features, training: Integers, name: str, regularisation: float, seed: int) -> Pairs | None:
    """Return the transform of a control; None if no training clip has what the control needs.

    Parameters
    ----------
    features, training, regularisation : see ``paired``.
    name : one of ``CONTROLS``.
    seed : of the controls that draw at random.
    """
    if name in WRONG_LIPS:
        found = {int(clip): WRONG_LIPS[name](features, int(clip), seed) for clip in training}
        wrong = {clip: lips for clip, lips in found.items() if lips is not None}
        if not wrong:
            return None
        audio = features.audio[features.rows(np.array(list(wrong)))]
        return _of_transform(canonical.fit(audio, np.concatenate(list(wrong.values())), regularisation))
    rows = features.rows(training)
    n_pairs = min(features.audio.shape[1], features.lips.shape[1])
    voice = Affine(*canonical.principal(features.audio[rows], n_pairs))
    if name == "audio alone":
        return Pairs(voice, Affine(voice.mean, np.roll(voice.basis, -1, axis=0)), True, np.zeros(0))
    return Pairs(voice, Affine(*canonical.principal(features.lips[rows], n_pairs)), False, np.zeros(0))


def _of_transform(found: canonical.Canonical) -> Pairs:
    return Pairs(Affine(found.mean_x, found.basis_x), Affine(found.mean_y, found.basis_y), False, found.correlations)


def _own(features: Features, clip: int) -> Floats:
    return features.lips[features.begin[clip] : features.begin[clip] + features.length[clip]]


def stretched(frames: Floats, n_frames: int) -> Floats:
    """Return frames (T, D) stretched linearly to another number of frames."""
    places = np.linspace(0.0, len(frames) - 1.0, n_frames)
    before = np.minimum(places.astype(np.int64), max(len(frames) - 2, 0))
    share = (places - before)[:, None]
    after = np.minimum(before + 1, len(frames) - 1)
    mixed: Floats = (1.0 - share) * frames[before] + share * frames[after]
    return mixed


def _of_another(features: Features, clip: int, same: str, differs: str, seed: int) -> Floats | None:
    """Return lips of another clip, with the value of ``same`` in common but not that of ``differs``, stretched."""
    clips = features.clips
    match = (clips[same] == clips[same].iloc[clip]) & (clips[differs] != clips[differs].iloc[clip])
    others = np.flatnonzero((match & clips[differs].notna()).to_numpy())
    if not len(others):
        return None
    name = str(clips["clip"].iloc[clip])
    other = int(random_source(seed, "wrong lips", same, name).choice(others))
    return stretched(_own(features, other), int(features.length[clip]))


def _another_speaker(features: Features, clip: int, seed: int) -> Floats | None:
    return _of_another(features, clip, "phrase", "speaker", seed)


def _another_name(features: Features, clip: int, seed: int) -> Floats | None:
    return _of_another(features, clip, "speaker", "phrase", seed)


def _scrambled(features: Features, clip: int, seed: int) -> Floats:
    rng = random_source(seed, "scrambled", str(features.clips["clip"].iloc[clip]))
    return rng.permutation(_own(features, clip), axis=0)


def _noise(features: Features, clip: int, seed: int) -> Floats:
    """Return noise with the spectra and cross-spectra of the lip features: their Fourier phases plus random ones."""
    own = _own(features, clip)
    rng = random_source(seed, "noise", str(features.clips["clip"].iloc[clip]))
    spectrum = np.fft.rfft(own, axis=0)
    turns = np.exp(2j * np.pi * rng.uniform(size=len(spectrum)))
    turns[0] = 1.0
    if len(own) % 2 == 0:
        turns[-1] = 1.0
    noise: Floats = np.fft.irfft(spectrum * turns[:, None], len(own), axis=0)
    return noise


WRONG_LIPS: dict[str, Callable[[Features, int, int], Floats | None]] = {
    "another speaker": _another_speaker,
    "another name": _another_name,
    "scrambled": _scrambled,
    "noise": _noise,
}
"""The controls with lips that do not belong to the voice: ``(features, clip, seed) -> (T, N_L)``."""
