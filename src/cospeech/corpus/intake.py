"""Read one record of the corpus: load its motion and speech, compare their lengths and trim both to the shorter."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.corpus import motion, retarget, user_tables
from cospeech.data import segments
from cospeech.errors import UserError
from cospeech.formats import sound
from cospeech.motion import skeleton

Record = dict[str, Any]

MIN_DURATION_S = 1.0
"""Duration below which a record contains no phrase to learn from."""


class Body(NamedTuple):
    """The motion of a record: a motion table, or gesture segments with ``source`` None if only labels exist."""

    table: pd.DataFrame
    fps: float
    duration_s: float
    source: str | None
    notes: list[str]


class Voice(NamedTuple):
    """The speech of a record: sound, or a prosody table, and perhaps syllables, if only features exist."""

    samples: sound.Floats | None
    table: pd.DataFrame | None
    syllables: pd.DataFrame | None
    delivered_hz: float
    duration_s: float
    notes: list[str]


class Intake(NamedTuple):
    """A record as it was read: its row of the record table, its motion and its speech, all of the same duration.

    ``syllables`` is None unless the record brings a table of them.
    """

    row: pd.DataFrame
    body: pd.DataFrame
    voice: sound.Floats | pd.DataFrame
    syllables: pd.DataFrame | None


def read_record(
    entry: Record,
    motion_path: str | None,
    skipped_s: float,
    conventions: retarget.MotionConventions,
    labels: list[str],
    frame_s: float,
    tolerance_s: float,
) -> Intake:
    """Read the files of a record and trim motion and speech to their common duration.

    Parameters
    ----------
    entry : the record as listed in the configuration: files, excerpt, channel, actor, scenario, language.
    motion_path : its motion file, or the motion table computed from its films or markers; None for gesture segments.
    skipped_s : time in seconds by which the motion begins later than the sound; this part of the sound is skipped.
    conventions : what motion files do not state themselves (axes, unit, joint names, rest pose).
    labels : the gesture classes.
    frame_s : prosody frame period in seconds.
    tolerance_s : largest difference in duration between motion and speech, in seconds.

    Raises
    ------
    UserError : if a file is invalid, or if the durations of motion and speech differ too much.
    """
    excerpt = (entry["start_s"] or 0.0, entry["end_s"])
    body = _body(entry, motion_path, conventions, labels, *excerpt)
    voice = _voice(entry, frame_s, skipped_s, *excerpt)
    duration, trimmed = common_length(entry["record"], body.duration_s, voice.duration_s, tolerance_s)
    notes = [*body.notes, *voice.notes, *trimmed]
    row = pd.DataFrame(
        {
            "actor": [entry["actor"]],
            "record": [entry["record"]],
            "scenario": [entry["scenario"]],
            "language": [entry["language"]],
            "motion_source": [body.source],
            "motion_fps": [body.fps if motion_path else np.nan],
            "audio_rate_hz": [voice.delivered_hz],
            "duration_s": [duration],
            "motion_path": [entry["motion"] or entry["views"]],
            "audio_path": [entry["audio"]],
            "note": ["; ".join(notes) or None],
        }
    )
    spoken = None if voice.syllables is None else cut_syllables(voice.syllables, 0.0, duration)
    return Intake(row, _cut_body(body, duration), _cut_voice(voice, duration, frame_s), spoken)


def common_length(record: str, body_s: float, voice_s: float, tolerance_s: float) -> tuple[float, list[str]]:
    """Return the common duration of body and voice, and a note if the longer one is trimmed.

    Raises
    ------
    UserError : if they differ by more than the tolerance, or last less than a second.
    """
    longer = "body" if body_s > voice_s else "voice"
    excess, shared = abs(body_s - voice_s), min(body_s, voice_s)
    if excess > tolerance_s:
        raise UserError(
            f"record '{record}': its motion lasts {body_s:.3f} s and its sound {voice_s:.3f} s; check that they "
            "belong together, set start_s and end_s, or increase corpus.length_tolerance_s"
        )
    if shared < MIN_DURATION_S:
        raise UserError(f"record '{record}': lasts only {shared:.3f} s, too short to learn from; use a longer one")
    return shared, [f"{longer} trimmed by {excess:.3f} s at its end"] if excess >= 0.0005 else []


def _body(
    entry: Record,
    motion_path: str | None,
    conventions: retarget.MotionConventions,
    labels: list[str],
    start: float,
    end: float | None,
) -> Body:
    if motion_path:
        found = motion.read(motion_path, conventions, start, end)
        captured = "video" if entry["views"] else "markers"
        source = found.source if motion_path == entry["motion"] else captured
        return Body(found.table, found.fps, found.duration_s, source, found.notes)
    table = user_tables.gestures(entry["gestures"], entry["record"], labels)
    fps = round(float(table["end_frame"].iloc[-1] / table["end_s"].iloc[-1]), 6)
    table = cut_segments(
        table, fps, *_row_range(entry["gestures"], int(table["end_frame"].iloc[-1]), 1 / fps, start, end)
    )
    return Body(table, fps, float(table["end_s"].iloc[-1]), None, [])


def _voice(entry: Record, frame_s: float, skipped_s: float, start: float, end: float | None) -> Voice:
    if entry["audio"]:
        last = end if end is None else end + skipped_s
        audio = sound.read(entry["audio"], start + skipped_s, last, entry["channel"], mix_different=True)
        skipped = [f"sound taken from {skipped_s:.3f} s on, where the films begin"] if skipped_s else []
        return Voice(audio.samples, None, None, audio.delivered_hz, audio.duration_s, [*skipped, *audio.notes])
    table = user_tables.prosody(entry["prosody"], frame_s)
    first, last = _row_range(entry["prosody"], len(table), frame_s, start, end)
    duration_s = (last - first) * frame_s
    spoken = None
    if entry["syllables"]:
        spoken = cut_syllables(user_tables.syllables(entry["syllables"], entry["record"]), start, start + duration_s)
    return Voice(None, table.iloc[first:last], spoken, np.nan, duration_s, [])


def _row_range(path: str, n_frames: int, step_s: float, start_s: float, end_s: float | None) -> tuple[int, int]:
    first = round(start_s / step_s)
    last = n_frames if end_s is None else round(end_s / step_s)
    if last > n_frames or first >= last:
        raise UserError(
            f"{path}: lasts {n_frames * step_s:.3f} s and does not contain the excerpt from {start_s} s to "
            f"{end_s or 'its end'}; correct start_s and end_s"
        )
    return first, last


def cut_segments(table: pd.DataFrame, fps: float, first: int, last: int) -> pd.DataFrame:
    """Return the segments within frames [first, last), with frames renumbered from 0 at ``first``."""
    start = table["start_frame"].clip(lower=first)
    inside = start < table["end_frame"].clip(upper=last)
    return segments.from_starts(
        str(table["record"].iloc[0]), start[inside] - first, table["label"][inside], last - first, fps
    )


def cut_syllables(table: pd.DataFrame, start_s: float, end_s: float) -> pd.DataFrame:
    """Return the syllables whose peaks are between two times, renumbered, with times that count from ``start_s``."""
    inside = table[(table["peak_s"] >= start_s) & (table["peak_s"] < end_s)]
    times = ["start_s", "peak_s", "end_s", "known_s"]
    shifted = (inside[times].clip(start_s, end_s) - start_s).clip(lower=0.0)
    return inside.assign(syllable=np.arange(len(inside)), **shifted).reset_index(drop=True)


def _cut_body(body: Body, duration_s: float) -> pd.DataFrame:
    n_frames = int(duration_s * body.fps + 1e-6)
    if body.source is None:
        return cut_segments(body.table, body.fps, 0, n_frames)
    root = body.table[list(skeleton.ROOT_COLUMNS)].to_numpy()[:n_frames]
    return skeleton.motion_table(root, skeleton.angles(body.table)[:n_frames], body.fps)


def _cut_voice(voice: Voice, duration_s: float, frame_s: float) -> sound.Floats | pd.DataFrame:
    if voice.samples is not None:
        return voice.samples[: round(duration_s * sound.RATE_HZ)]
    assert voice.table is not None  # a voice has either sound or a table
    n_frames = int(duration_s / frame_s + 1e-6)
    table = voice.table.iloc[:n_frames].reset_index(drop=True)
    return table.assign(frame=np.arange(n_frames), time_s=segments.frame_times(n_frames, 1 / frame_s))
