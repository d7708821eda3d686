"""What is heard of speech, frame by frame: its prosody and its syllables, or its melody.

The samples are those of a recording of the same sound: they are limited to full scale, resampled to 16 kHz and
rounded to 16 bits. Samples that are not finite count as zero. Frames and syllables do not depend on the chunks in
which the sound arrives, to the last bit.

- Sound at 16 kHz, which includes files, gives exactly the frames and syllables of the recording. Other sampling rates
  on a pipe are resampled with less delay than recordings are, and may differ from them in the last of the 16 bits.
- The melody, at 100 Hz, is that of ``speech.melody_stream``. A system that needs it hears nothing else.
- Prosody features are normalised with statistics of the whole recording (``speech.prosody``). Here, the statistics
  are those of the last minute, so that the features adapt to voice and microphone. The labels of prosody clusters are
  found in the same minute. Only systems that need either get them, 12.5 ms later than syllables.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import soxr

from cospeech.data import segments
from cospeech.data.arrays import Floats, Labels
from cospeech.errors import UserError
from cospeech.formats.sound import FULL_SCALE, RATE_HZ
from cospeech.kernels.jit import njit
from cospeech.markov import labelled_hmm
from cospeech.markov.labelled_hmm import LabelledHMM
from cospeech.speech import melody, melody_stream, prosody, syllables
from cospeech.speech.syllables import Syllable
from cospeech.synthesis import live
from cospeech.synthesis.live import Heard

QUALITY = "HQ"
"""Quality of the resampler. It delays sound at 48 kHz by 6 to 36 ms; the best one, for recordings, by 9 to 76 ms."""

STREAM = "stream"
"""Name of the stream in place of that of a record."""

RECENT_S = 60.0
"""Length of the speech that prosody is normalised with and labels are found in, in seconds."""


@njit
def _limit(samples: Floats) -> int:
    """Limit samples (n,) to full scale in place, and return how many of them were not finite and are zero now."""
    n_bad = 0
    for i in range(len(samples)):
        if not np.isfinite(samples[i]):
            samples[i] = 0.0
            n_bad += 1
        samples[i] = min(max(samples[i], -1.0), 1.0)
    return n_bad


@njit
def _round(samples: Floats, full_scale: float) -> int:
    """Round samples (n,) to 16 bits in place, and return how many of them are at full scale."""
    n_full = 0
    for i in range(len(samples)):
        value = min(max(np.round(samples[i] * full_scale), -full_scale), full_scale - 1.0)
        if abs(value) >= full_scale - 1.0:
            n_full += 1
        samples[i] = value / full_scale
    return n_full


class Recent:
    """The prosody of the last minute of a stream.

    Parameters
    ----------
    frame_s : distance between frames in seconds.
    voiced_gain : gain above which a frame is voiced.
    clusters : the model that finds prosody labels.
    """

    def __init__(self, frame_s: float, voiced_gain: float, clusters: LabelledHMM) -> None:
        self.frame_s, self.clusters = frame_s, clusters
        self._voiced_gain = voiced_gain
        self._frames: deque[tuple[float, float, float]] = deque(maxlen=round(RECENT_S / frame_s))
        self.n_heard = 0

    def append(self, intensity_log: float, lag_s: float, gain: float) -> None:
        """Add the measurements of the next frame; see ``speech.prosody.Frames``."""
        self._frames.append((intensity_log, lag_s, gain))
        self.n_heard += 1

    @property
    def first(self) -> int:
        """The number of the first frame that is remembered."""
        return self.n_heard - len(self._frames)

    def table(self) -> pd.DataFrame | None:
        """Return the prosody table of the remembered frames, with times from its first frame; None without speech."""
        frames = prosody.Frames(*np.array(self._frames).T)
        try:
            statistics = prosody.statistics(STREAM, frames, self._voiced_gain)
        except UserError:  # no frame is voiced, or the intensity is constant
            return None
        return prosody.features(frames, statistics, self.frame_s)

    def labels(self, table: pd.DataFrame) -> Labels:
        """Return the prosody label (T,) of each row of ``table``."""
        found = labelled_hmm.phrases(self.clusters, STREAM, table, 1.0 / self.frame_s)
        return segments.to_labels(found)

    def latest(self, labelled: bool) -> tuple[str, dict[str, float]]:
        """Return prosody label and features of the latest frame.

        The label is empty if it is not wanted. If no speech was heard in the last minute, it is empty, too, and all
        features are 0.
        """
        table = self.table()
        if table is None:
            names = [*prosody.FEATURES, *(f"d_{name}" for name in prosody.FEATURES)]
            return "", dict.fromkeys(names, 0.0)
        features = {str(name): float(value) for name, value in table.iloc[-1].items() if name != "frame"}
        return str(self.labels(table)[-1]) if labelled else "", features


class Troubles(NamedTuple):
    """What was wrong with the samples: how many were not finite, and how many are at full scale."""

    n_not_finite: int
    n_full_scale: int


class Hearing:
    """Turns chunks of sound into prosody frames with their syllables, or into frames of the melody.

    Parameters
    ----------
    rate_hz : sampling rate of the sound in Hz.
    needs : what the system needs (see ``declaration.System``).
    settings : the section ``speech`` of the configuration.
    clusters : the model that finds prosody labels; None if the system needs none.
    seed : seed of the noise between the utterances of the melody.

    Attributes
    ----------
    frame_s : distance between frames in seconds, of prosody or melody.
    n_samples : number of samples heard, at 16 kHz.
    recent : the prosody of the last minute; None if the system needs neither prosody nor its labels.
    """

    def __init__(
        self,
        rate_hz: int,
        needs: Collection[str],
        settings: Mapping[str, Any],
        clusters: LabelledHMM | None,
        seed: int = 0,
    ) -> None:
        self.frame_s = melody.STEP_S if "melody" in needs else float(settings["frame_s"])
        self.n_samples = 0
        self.recent: Recent | None = None
        self._needs = needs
        self._resampler = (
            soxr.ResampleStream(rate_hz, RATE_HZ, 1, dtype="float64", quality=QUALITY) if rate_hz != RATE_HZ else None
        )
        self._syllables = syllables.Stream(RATE_HZ)
        self._waiting: deque[tuple[int, dict[str, float]]] = deque()
        self._n_syllables = self._n_frames = 0
        self._n_not_finite = self._n_full_scale = 0
        self._melody = melody_stream.Stream(RATE_HZ, STREAM, seed) if "melody" in needs else None
        if {"prosody", "prosody_labels"} & set(needs):
            assert clusters is not None
            how = dict(settings)
            self.recent = Recent(self.frame_s, how.pop("voiced_gain"), clusters)
            self._prosody = prosody.Stream(RATE_HZ, **how)

    @property
    def n_frames(self) -> int:
        """The number of whole prosody frames in the sound heard so far."""
        return int(self.n_samples / (self.frame_s * RATE_HZ) + 1e-6)

    @property
    def troubles(self) -> Troubles:
        """What was wrong with the samples heard so far."""
        return Troubles(self._n_not_finite, self._n_full_scale)

    def push(self, samples: Floats) -> Iterator[Heard]:
        """Continue the stream by samples (n,), full scale 1, and yield the frames that are complete now.

        ``recent`` ends with the frame that was yielded last, whatever the number of samples. The frames have neither
        labels nor features; see ``Recent.latest``.
        """
        samples = np.array(samples, dtype=float)
        self._n_not_finite += _limit(samples)
        if self._resampler is not None:
            samples = self._resampler.resample_chunk(samples)
        yield from self._hear(samples)

    def finish(self) -> Iterator[Heard]:
        """End the stream, and yield its remaining frames.

        Syllables that become known only because the stream ends belong to no frame.
        """
        if self._resampler is not None:
            yield from self._hear(self._resampler.resample_chunk(np.empty(0), last=True))
        if self._melody is not None:
            yield from self._melodic(self._melody.finish())
        if self.recent is not None:
            yield from self._measured(self.recent, self._prosody.finish())

    def _hear(self, samples: Floats) -> Iterator[Heard]:
        """Yield the frames that samples (n,) at 16 kHz complete."""
        self._n_full_scale += _round(samples, FULL_SCALE)
        self.n_samples += len(samples)
        if self._melody is not None:
            yield from self._melodic(self._melody.push(samples))
            return
        if "syllables" in self._needs:
            for one in self._syllables.push(samples):
                row = {"syllable": float(self._n_syllables), **dict(zip(Syllable._fields, one, strict=True))}
                self._waiting.append((live.frame_at(one.known_s, self.frame_s), row))
                self._n_syllables += 1
        if self.recent is not None:
            yield from self._measured(self.recent, self._prosody.push(samples))
        else:
            for _ in range(self.n_frames - self._n_frames):
                yield self._frame()

    def _melodic(self, frames: Floats) -> Iterator[Heard]:
        """Yield frames of the melody (T, 3) at once, if there are any."""
        if len(frames):
            first, self._n_frames = self._n_frames, self._n_frames + len(frames)
            yield Heard(first, (first + 0.5) * self.frame_s, "", {}, melody=frames)

    def _measured(self, recent: Recent, frames: prosody.Frames) -> Iterator[Heard]:
        for values in zip(*(column.tolist() for column in frames), strict=True):
            recent.append(*values)
            yield self._frame()

    def _frame(self) -> Heard:
        number = self._n_frames
        self._n_frames += 1
        known = []
        while self._waiting and self._waiting[0][0] <= number:
            known.append(self._waiting.popleft()[1])
        return Heard(number, (number + 0.5) * self.frame_s, "", {}, tuple(known))
