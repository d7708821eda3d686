"""Read one record of the corpus: load its motion, head and speech, and trim them to the length of the shortest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.corpus import head_angles, motion, retarget, user_tables
from cospeech.data import segments
from cospeech.errors import UserError
from cospeech.formats import sound
from cospeech.motion import head as heads
from cospeech.motion import skeleton

Record = dict[str, Any]

MIN_DURATION_S = 1.0
"""Duration below which a record contains no phrase to learn from."""


class Body(NamedTuple):
    """The body of a record: a motion table, or gesture segments with ``source`` None if only labels exist."""

    table: pd.DataFrame
    fps: float
    duration_s: float
    source: str | None
    notes: list[str]


class Head(NamedTuple):
    """The angles of the head of a record (schema ``head``)."""

    table: pd.DataFrame
    fps: float
    duration_s: float
    source: str


class Voice(NamedTuple):
    """The speech of a record: sound, or tables of its features if only these exist; at least one of the three."""

    samples: sound.Floats | None
    table: pd.DataFrame | None
    syllables: pd.DataFrame | None
    melody: pd.DataFrame | None
    delivered_hz: float
    durations_s: dict[str, float]
    notes: list[str]


class Intake(NamedTuple):
    """A record as it was read: its row of the record table, its motion, speech and head, all of the same duration.

    Attributes
    ----------
    row : schema ``records``.
    body : motion table, or segment table of gestures; None for a head alone.
    voice : (n,) sound, or prosody table; None if only a melody exists.
    syllables, melody, head : tables of these schemas, or None where the record brings none.
    """

    row: pd.DataFrame
    body: pd.DataFrame | None
    voice: sound.Floats | pd.DataFrame | None
    syllables: pd.DataFrame | None
    melody: pd.DataFrame | None
    head: pd.DataFrame | None


SHORTENED = {"motion": "body", "sound": "voice", "head": "head", "melody": "melody"}
"""What the note of a record calls the parts that are trimmed."""


def read_record(
    entry: Record,
    motion_path: str | None,
    skipped_s: float,
    conventions: retarget.MotionConventions,
    labels: list[str],
    frame_s: float,
    tolerance_s: float,
    head_path: str | None = None,
    head_conventions: head_angles.HeadConventions | None = None,
) -> Intake:
    """Read the files of a record and trim motion, head and speech to their common duration.

    Parameters
    ----------
    entry : the record as listed in the configuration: files, excerpt, channel, actor, scenario, language.
    motion_path : its motion file, or the motion table computed from its films or markers; None for gesture segments,
        or where there is only a head.
    skipped_s : time in seconds by which the motion begins later than the sound; this part of the sound is skipped.
    conventions : what motion files do not state themselves (axes, unit, joint names, rest pose).
    labels : the gesture classes.
    frame_s : prosody frame period in seconds.
    tolerance_s : largest difference in duration between motion, head and speech, in seconds.
    head_path : the file with the angles of its head, or the table of poses computed from its films; None: no head
        of its own.
    head_conventions : what files of head angles do not state themselves; needed with ``head_path``.

    Raises
    ------
    UserError : if a file is invalid, or if the durations of motion, head and speech differ too much.
    """
    excerpt = (entry["start_s"] or 0.0, entry["end_s"])
    body = _body(entry, motion_path, conventions, labels, *excerpt)
    head = _head(entry, head_path, head_conventions, *excerpt) if head_path and head_conventions else None
    voice = _voice(entry, frame_s, skipped_s, *excerpt)
    parts = {"motion": body, "head": head}
    durations = {name: part.duration_s for name, part in parts.items() if part is not None} | voice.durations_s
    duration, trimmed = common_length(entry["record"], durations, tolerance_s)
    notes = [*(body.notes if body else []), *voice.notes, *trimmed]
    row = pd.DataFrame(
        {
            "actor": [entry["actor"]],
            "record": [entry["record"]],
            "scenario": [entry["scenario"]],
            "language": [entry["language"]],
            "motion_source": [body.source if body else None],
            "motion_fps": [body.fps if body and motion_path else np.nan],
            "audio_rate_hz": [voice.delivered_hz],
            "duration_s": [duration],
            "motion_path": [entry["motion"] or entry["views"]],
            "audio_path": [entry["audio"]],
            "note": ["; ".join(notes) or None],
            "head_source": [head.source if head else None],
            "head_fps": [head.fps if head else np.nan],
        }
    )
    return Intake(
        row,
        _cut_body(body, duration) if body else None,
        _cut_voice(voice, duration, frame_s),
        None if voice.syllables is None else cut_syllables(voice.syllables, 0.0, duration),
        None if voice.melody is None else _cut_frames(voice.melody, duration, user_tables.MELODY_S),
        None if head is None else _cut_frames(head.table, duration, 1.0 / head.fps),
    )


def common_length(record: str, durations_s: Mapping[str, float], tolerance_s: float) -> tuple[float, list[str]]:
    """Return the common duration of the parts of a record, by name, and notes on those that are trimmed.

    Raises
    ------
    UserError : if they differ by more than the tolerance, or last less than a second.
    """
    shared = min(durations_s.values())
    longest = max(durations_s, key=lambda name: durations_s[name])
    if durations_s[longest] - shared > tolerance_s:
        shortest = min(durations_s, key=lambda name: durations_s[name])
        (one, one_s), (other, other_s) = ((k, v) for k, v in durations_s.items() if k in (longest, shortest))
        raise UserError(
            f"record '{record}': its {one} lasts {one_s:.3f} s and its {other} {other_s:.3f} s; check that they "
            "belong together, set start_s and end_s, or increase corpus.length_tolerance_s"
        )
    if shared < MIN_DURATION_S:
        raise UserError(f"record '{record}': lasts only {shared:.3f} s, too short to learn from; use a longer one")
    excesses = {name: length_s - shared for name, length_s in durations_s.items()}
    return shared, [
        f"{SHORTENED[name]} trimmed by {excess:.3f} s at its end"
        for name, excess in excesses.items()
        if excess >= 0.0005
    ]


def _body(
    entry: Record,
    motion_path: str | None,
    conventions: retarget.MotionConventions,
    labels: list[str],
    start: float,
    end: float | None,
) -> Body | None:
    if motion_path:
        found = motion.read(motion_path, conventions, start, end)
        captured = "video" if entry["views"] else "markers"
        source = found.source if motion_path == entry["motion"] else captured
        return Body(found.table, found.fps, found.duration_s, source, found.notes)
    if not entry["gestures"]:
        return None
    table = user_tables.gestures(entry["gestures"], entry["record"], labels)
    fps = round(float(table["end_frame"].iloc[-1] / table["end_s"].iloc[-1]), 6)
    table = cut_segments(
        table, fps, *_row_range(entry["gestures"], int(table["end_frame"].iloc[-1]), 1 / fps, start, end)
    )
    return Body(table, fps, float(table["end_s"].iloc[-1]), None, [])


def _head(
    entry: Record, path: str, conventions: head_angles.HeadConventions, start: float, end: float | None
) -> Head:
    table = head_angles.read(path, entry["record"], conventions)
    fps = heads.frame_rate(table)
    first, last = _row_range(path, len(table), 1 / fps, start, end)
    source = "table" if entry["head"] else "stereo" if entry["film_right"] else "film"
    return Head(heads.table(table[heads.COLUMNS].to_numpy()[first:last], fps), fps, (last - first) / fps, source)


def _voice(entry: Record, frame_s: float, skipped_s: float, start: float, end: float | None) -> Voice:
    if entry["audio"]:
        last = end if end is None else end + skipped_s
        audio = sound.read(entry["audio"], start + skipped_s, last, entry["channel"], mix_different=True)
        skipped = [f"sound taken from {skipped_s:.3f} s on, where the films begin"] if skipped_s else []
        notes = [*skipped, *audio.notes]
        return Voice(audio.samples, None, None, None, audio.delivered_hz, {"sound": audio.duration_s}, notes)
    table, spoken, melody = None, None, None
    durations = {}
    if entry["prosody"]:
        table = user_tables.prosody(entry["prosody"], frame_s)
        first, last = _row_range(entry["prosody"], len(table), frame_s, start, end)
        table, durations["sound"] = table.iloc[first:last], (last - first) * frame_s
    if entry["syllables"]:
        stop = start + durations["sound"]
        spoken = cut_syllables(user_tables.syllables(entry["syllables"], entry["record"]), start, stop)
    if entry["melody"]:
        melody = user_tables.melody(entry["melody"])
        first, last = _row_range(entry["melody"], len(melody), user_tables.MELODY_S, start, end)
        melody, durations["melody"] = melody.iloc[first:last], (last - first) * user_tables.MELODY_S
    return Voice(None, table, spoken, melody, np.nan, durations, [])


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


def _cut_voice(voice: Voice, duration_s: float, frame_s: float) -> sound.Floats | pd.DataFrame | None:
    if voice.samples is not None:
        return voice.samples[: round(duration_s * sound.RATE_HZ)]
    return None if voice.table is None else _cut_frames(voice.table, duration_s, frame_s)


def _cut_frames(table: pd.DataFrame, duration_s: float, frame_s: float) -> pd.DataFrame:
    """Return the first frames of a table, renumbered, as many as fit into a duration."""
    n_frames = int(duration_s / frame_s + 1e-6)
    cut = table.iloc[:n_frames].reset_index(drop=True)
    return cut.assign(frame=np.arange(n_frames), time_s=segments.frame_times(n_frames, 1 / frame_s))
