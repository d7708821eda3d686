"""One record of the corpus as it enters: body and voice read, held against each other and cut to one length."""

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

SHORTEST_S = 1.0
"""Length below which a record has no phrase to learn from."""


class Body(NamedTuple):
    """What the body did: a motion table, or gesture segments in its place."""

    table: pd.DataFrame
    fps: float
    duration_s: float
    source: str | None
    notes: list[str]


class Voice(NamedTuple):
    """What was said: sound, or a prosody table in its place."""

    samples: sound.Floats | None
    table: pd.DataFrame | None
    delivered_hz: float
    duration_s: float
    notes: list[str]


class Intake(NamedTuple):
    """A record on its way in: its row of the record sheet, its body and its voice, all of one length."""

    row: pd.DataFrame
    body: pd.DataFrame
    voice: sound.Floats | pd.DataFrame


def take(
    given: Record,
    moved: str | None,
    late_s: float,
    declared: retarget.Declaration,
    labels: list[str],
    frame_s: float,
    tolerance_s: float,
) -> Intake:
    """Read the files of a record and cut body and voice to the length they share.

    Parameters
    ----------
    given : the record as the configuration lists it: files, excerpt, actor, scenario, language.
    moved : its motion file, or the motion table that was made of its films or markers.
    late_s : how much later than the sound the motion begins, which the sound passes over.
    declared : what motion files do not say of themselves.
    labels : the gesture classes.
    frame_s : distance of prosody frames.
    tolerance_s : how much body and voice may differ in length.

    Raises
    ------
    UserError : at the first thing wrong with a file, or where the two lengths differ too much.
    """
    excerpt = (given["start_s"] or 0.0, given["end_s"])
    body = _body(given, moved, declared, labels, *excerpt)
    voice = _voice(given, frame_s, late_s, *excerpt)
    duration, trimmed = common_length(given["record"], body.duration_s, voice.duration_s, tolerance_s)
    notes = [*body.notes, *voice.notes, *trimmed]
    row = pd.DataFrame(
        {
            "actor": [given["actor"]],
            "record": [given["record"]],
            "scenario": [given["scenario"]],
            "language": [given["language"]],
            "motion_source": [body.source],
            "motion_fps": [body.fps if moved else np.nan],
            "audio_rate_hz": [voice.delivered_hz],
            "duration_s": [duration],
            "motion_path": [given["motion"] or given["views"]],
            "audio_path": [given["audio"]],
            "note": ["; ".join(notes) or None],
        }
    )
    return Intake(row, _cut_body(body, duration), _cut_voice(voice, duration, frame_s))


def common_length(record: str, body_s: float, voice_s: float, tolerance_s: float) -> tuple[float, list[str]]:
    """Return the length that body and voice share, and a note on what the longer one loses.

    Raises
    ------
    UserError : where they differ by more than the tolerance, or last less than a second.
    """
    longer = "body" if body_s > voice_s else "voice"
    excess, shared = abs(body_s - voice_s), min(body_s, voice_s)
    if excess > tolerance_s:
        raise UserError(
            f"record '{record}': its motion lasts {body_s:.3f} s and its sound {voice_s:.3f} s; check that they "
            "belong together, set start_s and end_s, or raise corpus.length_tolerance_s"
        )
    if shared < SHORTEST_S:
        raise UserError(f"record '{record}': lasts {shared:.3f} s, too short to learn from; name a longer one")
    return shared, [f"{longer} trimmed by {excess:.3f} s at its end"] if excess >= 0.0005 else []


def _body(
    given: Record,
    moved: str | None,
    declared: retarget.Declaration,
    labels: list[str],
    start: float,
    end: float | None,
) -> Body:
    if moved:
        found = motion.read(moved, declared, start, end)
        captured = "video" if given["views"] else "markers"
        source = found.source if moved == given["motion"] else captured
        return Body(found.table, found.fps, found.duration_s, source, found.notes)
    table = user_tables.gestures(given["gestures"], given["record"], labels)
    fps = round(float(table["end_frame"].iloc[-1] / table["end_s"].iloc[-1]), 6)
    table = cut_segments(table, fps, *_rows(given["gestures"], int(table["end_frame"].iloc[-1]), 1 / fps, start, end))
    return Body(table, fps, float(table["end_s"].iloc[-1]), None, [])


def _voice(given: Record, frame_s: float, late_s: float, start: float, end: float | None) -> Voice:
    if given["audio"]:
        heard = sound.read(given["audio"], start + late_s, end if end is None else end + late_s)
        passed = [f"sound taken from {late_s:.3f} s on, where the films begin"] if late_s else []
        return Voice(heard.samples, None, heard.delivered_hz, heard.duration_s, [*passed, *heard.notes])
    table = user_tables.prosody(given["prosody"], frame_s)
    first, last = _rows(given["prosody"], len(table), frame_s, start, end)
    return Voice(None, table.iloc[first:last], np.nan, (last - first) * frame_s, [])


def _rows(path: str, n_frames: int, step_s: float, start_s: float, end_s: float | None) -> tuple[int, int]:
    first = round(start_s / step_s)
    last = n_frames if end_s is None else round(end_s / step_s)
    if last > n_frames or first >= last:
        raise UserError(
            f"{path}: lasts {n_frames * step_s:.3f} s, so no excerpt from {start_s} s to {end_s or 'its end'} is in "
            "it; correct start_s and end_s"
        )
    return first, last


def cut_segments(table: pd.DataFrame, fps: float, first: int, last: int) -> pd.DataFrame:
    """Return the segments within frames [first, last), counted from there."""
    start = table["start_frame"].clip(lower=first)
    inside = start < table["end_frame"].clip(upper=last)
    return segments.from_starts(
        str(table["record"].iloc[0]), start[inside] - first, table["label"][inside], last - first, fps
    )


def _cut_body(body: Body, duration_s: float) -> pd.DataFrame:
    n_frames = int(duration_s * body.fps + 1e-6)
    if body.source is None:
        return cut_segments(body.table, body.fps, 0, n_frames)
    root = body.table[list(skeleton.ROOT_COLUMNS)].to_numpy()[:n_frames]
    return skeleton.motion_table(root, skeleton.angles(body.table)[:n_frames], body.fps)


def _cut_voice(voice: Voice, duration_s: float, frame_s: float) -> sound.Floats | pd.DataFrame:
    if voice.samples is not None:
        return voice.samples[: round(duration_s * sound.RATE_HZ)]
    assert voice.table is not None  # a voice is one of the two
    n_frames = int(duration_s / frame_s + 1e-6)
    table = voice.table.iloc[:n_frames].reset_index(drop=True)
    return table.assign(frame=np.arange(n_frames), time_s=segments.frame_times(n_frames, 1 / frame_s))
