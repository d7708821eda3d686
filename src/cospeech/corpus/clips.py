"""The sheet of a user's own films of speaking faces: who says what, in which file.

A sheet is a CSV file with a line per film and the columns ``file``, ``speaker`` (empty: unknown), ``phrase`` and
``session`` (a number from 1, or empty). ``sound`` names a sound file if the film has none, ``own_name`` (yes or no)
says whether the phrase is that which identifies the speaker, by default the first one that is listed for a speaker,
and ``mouth_x_px`` and ``mouth_y_px`` state the middle of the mouth in the first frame, by default it is looked for.
Paths are relative to the sheet. A line that cannot be used is reported and left out.
"""

from __future__ import annotations

import difflib
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import av
import pandas as pd

from cospeech.errors import UserError
from cospeech.formats import delimited, films

REQUIRED = ("file", "speaker", "phrase", "session")
COLUMNS = (*REQUIRED, "sound", "own_name", "mouth_x_px", "mouth_y_px")
ANSWERS = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}
SLOWEST_FPS = 8.0
"""Frame rate below which lips cannot be followed: a syllable lasts a fifth of a second."""


@dataclass(frozen=True)
class Clips:
    """What a sheet says.

    Attributes
    ----------
    clips : table of clips (schema ``clips``).
    mouths : table of the mouths that are stated (schema ``mouths``).
    notes : a line for each film that was left out, and on films that differ from the others.
    """

    clips: pd.DataFrame
    mouths: pd.DataFrame
    notes: list[str]


@dataclass(frozen=True)
class Film:
    """Frame rate and duration of a film, and whether it has sound."""

    fps: float
    duration_s: float
    has_sound: bool


def read(path: str | Path) -> Clips:
    """Read a sheet, and look at the films that it names.

    Raises
    ------
    UserError : if the sheet cannot be read, lacks a column, has an unknown one, or names no film that can be used.
    """
    sheet = delimited.read(path, COLUMNS)
    _check_columns(sheet.columns, str(path))
    rows: list[dict[str, object]] = []
    mouths: list[dict[str, object]] = []
    notes: list[str] = []
    seen: dict[Path, int] = {}
    for line, cells in sheet.rows:
        try:
            row, mouth = _clip(cells, Path(path).parent, rows, seen, line)
        except UserError as error:
            notes.append(f"{path}: line {line} is left out: {error}")
            continue
        rows.append(row)
        mouths += mouth
    if not rows:
        first = f"; {notes[0].removeprefix(f'{path}: ')}" if notes else ""
        raise UserError(f"{path}: names no film that can be used{first}")
    clips = pd.DataFrame(rows)
    return Clips(clips, pd.DataFrame(mouths, columns=["clip", "x_px", "y_px"]), notes + _rates(clips, str(path)))


def files(path: str | Path) -> list[str]:
    """Return the films and the sound files that a sheet names, as far as they exist: what ``read`` depends on.

    A sheet that cannot be read names none; ``read`` says what is wrong with it.
    """
    try:
        rows = delimited.read(path, COLUMNS).rows
    except UserError:
        return []
    named = [
        Path(path).parent / cells[column] for _, cells in rows for column in ("file", "sound") if cells.get(column)
    ]
    return [str(file) for file in dict.fromkeys(named) if file.is_file()]


def _check_columns(columns: tuple[str, ...], path: str) -> None:
    for name in columns:
        if name not in COLUMNS:
            near = difflib.get_close_matches(name.lower(), COLUMNS, n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"known are {', '.join(COLUMNS)}"
            raise UserError(f"{path}: unknown column '{name[:40]}'; {hint}")
    missing = [name for name in REQUIRED if name not in columns]
    if missing:
        raise UserError(f"{path}: column '{missing[0]}' is missing; columns {', '.join(REQUIRED)} are needed")


def _clip(
    cells: dict[str, str], folder: Path, before: list[dict[str, object]], seen: dict[Path, int], line: int
) -> tuple[dict[str, object], list[dict[str, object]]]:
    """Return the row of a clip, and that of its mouth if it is stated.

    Raises
    ------
    UserError : if the line or its film cannot be used.
    """
    name, speaker, phrase = cells.get("file", ""), cells.get("speaker") or None, cells.get("phrase", "")
    if not name or not phrase:
        raise UserError("it needs a file and a phrase; complete it")
    film = folder / name
    if film.resolve() in seen:
        raise UserError(f"line {seen[film.resolve()]} names {name}, too; delete one of them")
    session, own_name = _session(cells.get("session", "")), _answer(cells.get("own_name", ""))
    sound = folder / cells["sound"] if cells.get("sound") else film
    mouth = _mouth(cells)
    facts = look_at(film)
    if sound == film and not facts.has_sound:
        raise UserError(f"{film}: has no sound; name its sound file in column 'sound'")
    if not sound.is_file():
        raise UserError(f"{sound}: no such file; correct the path")
    if facts.fps < SLOWEST_FPS:
        raise UserError(f"{film}: has {facts.fps:g} frames per second; lips need {SLOWEST_FPS:g} or more")
    seen[film.resolve()] = line
    clip = _unused(film.stem, {str(row["clip"]) for row in before})
    if own_name is None:
        known = [row["phrase"] for row in before if row["speaker"] == speaker]
        own_name = speaker is not None and phrase == (known[0] if known else phrase)
    row: dict[str, object] = {
        "clip": clip,
        "speaker": speaker,
        "phrase": phrase,
        "repetition": sum(one["speaker"] == speaker and one["phrase"] == phrase for one in before),
        "session": session,
        "own_name": own_name,
        "film": str(film),
        "sound": str(sound),
        "fps": facts.fps,
        "duration_s": facts.duration_s,
        "delay_planted_s": None,
    }
    return row, [] if mouth is None else [{"clip": clip, "x_px": mouth[0], "y_px": mouth[1]}]


def _session(text: str) -> str | None:
    if text and not re.fullmatch(r"0*[1-9]\d?", text):
        raise UserError(f"unknown session '{text[:20]}'; number the sessions from 1 to 99, or leave the cell empty")
    return f"session{int(text)}" if text else None


def _answer(text: str) -> bool | None:
    if text and text.lower() not in ANSWERS:
        raise UserError(f"own_name is '{text[:20]}'; write yes or no, or leave the cell empty")
    return ANSWERS[text.lower()] if text else None


def _mouth(cells: dict[str, str]) -> tuple[float, float] | None:
    """Return where the middle of the mouth is, None if that is not stated."""
    stated = [cells.get(name, "") for name in ("mouth_x_px", "mouth_y_px")]
    if not any(stated):
        return None
    numbers = [text.replace(",", ".") for text in stated]
    if not all(delimited.NUMBER.fullmatch(text) and float(text) >= 0.0 for text in numbers):
        raise UserError(f"mouth_x_px and mouth_y_px are '{stated[0]}' and '{stated[1]}'; state both, in pixels")
    return float(numbers[0]), float(numbers[1])


def _unused(name: str, used: set[str]) -> str:
    """Return a name for a clip: that of its file, with a number if an earlier one has the same."""
    if name not in used:
        return name
    return next(f"{name}_{n}" for n in range(2, len(used) + 3) if f"{name}_{n}" not in used)


def look_at(film: Path) -> Film:
    """Return the frame rate and the duration of a film, and whether it has sound.

    Raises
    ------
    UserError : if the file is missing, cannot be read, or contains no film.
    """
    if not film.is_file():
        raise UserError(f"{film}: no such file; correct the path")
    try:
        with films.opened(film) as container:
            if not container.streams.video:
                kind = "sound without a film" if container.streams.audio else "no film"
                raise UserError(f"{film}: contains {kind}; name a film of the speaking face")
            stream = container.streams.video[0]
            fps = float(stream.average_rate or stream.base_rate or 0)
            duration_s = container.duration / av.time_base if container.duration else 0.0
            return Film(fps, duration_s, bool(container.streams.audio))
    except (av.FFmpegError, OSError) as error:
        reason = " ".join(str(getattr(error, "strerror", None) or error).split())[:80]
        raise UserError(f"{film}: cannot be read as a film ({reason}); convert it to mp4") from error


def _rates(clips: pd.DataFrame, path: str) -> list[str]:
    """Return a note if films differ in their frame rates: the lips of all of them are interpolated to 100 Hz."""
    rates = Counter(f"{fps:g}" for fps in clips["fps"])
    if len(rates) == 1:
        return []
    usual, others = rates.most_common()[0][0], [f"{rates[rate]} at {rate}" for rate in rates]
    return [
        f"{path}: films have different frame rates ({', '.join(others)} per second); their lips are compared at "
        f"100 frames per second, but fast movements are only seen above {usual}"
    ]
