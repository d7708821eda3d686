"""The records of a run: the virtual studio's, or those that the configuration lists."""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cospeech.data.vocabulary import SCENARIOS
from cospeech.errors import MissingFileError, UserError
from cospeech.formats import delimited
from cospeech.workflow import paths
from cospeech.workflow.config import Config, actor_worlds

NAME = "[A-Za-z0-9][A-Za-z0-9_-]*"
"""What records and actors may be called, as a regular expression; data_schema/config.yaml says the same."""

RECORD_FIELDS = (
    "record", "actor", "scenario", "language", "motion", "views", "audio",
    "prosody", "syllables", "melody", "gestures", "head", "film_left", "film_right", "film_cameras",
    "focal_px", "focal_35mm", "annotations", "start_s", "end_s", "channel",
)  # fmt: skip

FILE_FIELDS = (
    "motion", "audio", "prosody", "syllables", "melody", "gestures", "head", "film_left", "film_right",
    "film_cameras", "annotations",
)  # fmt: skip

TIMES = ("start_s", "end_s")

FOCAL_LENGTHS = ("focal_px", "focal_35mm")
"""Ways to declare the focal length of the camera of a single film."""

RESERVED = "all"
"""What all actors together, and all scenarios, are called in tables of results."""

LONGEST_NAME = 100

Record = dict[str, Any]


def records(config: Config, results: str) -> dict[str, Record]:
    """Return the records by name, each with every field of ``RECORD_FIELDS`` (None where there is none).

    Raises
    ------
    UserError : a record listed twice, without speech or motion, of a missing file, or alone with its actor.
    """
    if config["corpus"]["source"] == "studio":
        listed = _studio_records(config, results)
    else:
        listed = [
            record | {"channel": record["channel"] or config["corpus"]["channel"]}
            for record in _listed_records(config["corpus"]["records"])
        ]
        _check_files(listed)
        listed = [_with_focal_length(record, config["capture"]["head"]) for record in listed]
    _check_names(listed)
    twice = [name for name, count in Counter(record["record"] for record in listed).items() if count > 1]
    if twice:
        raise UserError(f"config: corpus.records: '{twice[0]}' is listed twice; give each record a name of its own")
    alone = [name for name, count in Counter(record["actor"] for record in listed).items() if count < 2]
    if alone:
        raise UserError(
            f"config: actor '{alone[0]}' has one record, and leaving it out leaves nothing to learn from; "
            "add a record or cut the file into excerpts (start_s, end_s)"
        )
    return {record["record"]: record for record in listed}


def brings(listed: dict[str, Record]) -> frozenset[str]:
    """Return what every record of the corpus brings; nothing without any record.

    It is motion or gestures, or else the head alone; and audio or prosody, or, where there is only a head, audio or
    melody. A body can come with a head of its own, and prosody with syllables and melody.

    Raises
    ------
    UserError : where records differ in it, or one brings nothing.
    """
    kinds = {name: _kinds(name, record) for name, record in listed.items()}
    if not kinds:
        return frozenset()
    first_name, first = next(iter(kinds.items()))
    for name, kind in kinds.items():
        if kind != first:
            raise UserError(
                f"config: record '{name}' brings {' and '.join(sorted(kind))}, but '{first_name}' "
                f"{' and '.join(sorted(first))}; make two runs of them"
            )
    return first


def offers(brought: frozenset[str]) -> frozenset[str]:
    """Return what systems can need of records, from what these bring: more is found in sound and in motion."""
    found = {"audio": {"syllables", "melody"}, "motion": {"head"}}
    return brought.union(*(found[kind] for kind in brought & found.keys()))


def _kinds(name: str, record: Record) -> frozenset[str]:
    """Return what one record brings."""
    body = "motion" if record["motion"] or record["views"] else "gestures" if record["gestures"] else None
    head = "head" if record["head"] or record["film_left"] else None
    melody = "melody" if record["melody"] else None
    voice = "audio" if record["audio"] else "prosody" if record["prosody"] else None
    if body is None and head is None:
        raise UserError(
            f"config: record '{name}' has no motion (or views, or gestures, or a head); name a file for it in "
            "corpus.records"
        )
    if voice is None and (body or melody is None):
        sound = "audio (or prosody)" if body else "audio (or melody)"
        raise UserError(f"config: record '{name}' has no {sound}; name a file for it in corpus.records")
    if body is None and voice == "prosody":
        raise UserError(
            f"config: record '{name}' has a head and no body, which follows pitch and intensity at 100 Hz and not "
            "prosody; name its audio or its melody in corpus.records"
        )
    measured = next((kind for kind in ("syllables", "melody") if record[kind] and voice == "audio"), None)
    if measured:
        found = "syllables are found" if measured == "syllables" else "melody is measured"
        raise UserError(f"config: record '{name}': {found} in its audio; leave one of them out")
    syllables = "syllables" if record["syllables"] else None
    return frozenset(kind for kind in (body, head, voice, melody, syllables) if kind)


def transplants(config: Config, listed: Mapping[str, Record]) -> list[tuple[str, str]]:
    """Return the pairs of an actor whose model moves and a record whose voice drives it.

    Raises
    ------
    UserError : where a pair names an unknown actor or record.
    """
    actors = list(dict.fromkeys(record["actor"] for record in listed.values()))
    pairs = config["transplant"]["pairs"]
    if pairs == "auto":
        return [(actors[1], next(iter(listed)))] if len(actors) > 1 else []
    for pair in pairs:
        for key, known in (("model", actors), ("voice", list(listed))):
            if pair[key] not in known:
                kind = "actor" if key == "model" else "record"
                raise UserError(
                    f"config: transplant.pairs: no {kind} is called '{pair[key]}'; there are {', '.join(known)}"
                )
    return [(pair["model"], pair["voice"]) for pair in pairs]


def _studio_body(studio: Config, number: int, raw: str, cameras: str) -> Record:
    """Return what a record of the studio brings of the body, or of the head alone where a stereo camera films it.

    Parameters
    ----------
    studio : the settings of the studio.
    number : number of the record among those of its actor, counted from 0.
    raw : path of the record without an ending.
    cameras : path of the camera file of stereo films.
    """
    if studio["film"] == "stereo":
        return {"film_left": f"{raw}/left.mkv", "film_right": f"{raw}/right.mkv", "film_cameras": cameras}
    filmed = studio["film"] and (studio["filmed_records"] is None or number < studio["filmed_records"])
    return {"views": raw} if filmed else {"motion": f"{raw}.bvh"}


def _studio_features(studio: Config) -> tuple[str, ...]:
    """Return what a record of the studio brings without sound: a body, and a head if all actors have head gestures.

    Where these are all that depends on speech, and nobody asks for motion, there is only the head.
    """
    worlds = actor_worlds(studio).values()
    head = ("head", "melody") if all(own.world == "patterns" or own.head is not None for own in worlds) else ()
    if not studio["motion"] and all(own.world == "patterns" for own in worlds):
        return head
    return ("motion" if studio["motion"] else "gestures", "prosody", "syllables", *head)


def _studio_records(config: Config, results: str) -> list[Record]:
    listed = []
    for actor in config["studio"]["actors"]:
        for number in range(actor["records"]):
            name = f"{actor['actor']}_{number + 1}"
            raw = f"{results}/corpus/raw/{name}"
            record = dict.fromkeys(RECORD_FIELDS) | {
                "record": name,
                "actor": actor["actor"],
                "scenario": SCENARIOS[number % len(SCENARIOS)],
                "language": "Turkish",
            }
            if config["studio"]["sound"]:
                record |= _studio_body(config["studio"], number, raw, f"{results}/corpus/raw/stereo.toml")
                record["audio"] = f"{raw}.wav"
            else:
                raw = f"{results}/corpus/raw/{actor['actor']}/{name}"
                record |= {kind: f"{raw}.{kind}.parquet" for kind in _studio_features(config["studio"])}
            listed.append(record)
    return listed


def _listed_records(given: str | list[Record]) -> list[Record]:
    """Return the records of a sheet or of a list in the configuration, whose times may be written as h:mm:ss."""
    if isinstance(given, str):
        return [dict.fromkeys(RECORD_FIELDS) | record for record in _read_sheet(Path(given))]
    listed = [dict.fromkeys(RECORD_FIELDS) | record for record in given]
    for record in listed:
        for key in TIMES:
            text = record[key]
            if isinstance(text, str):
                try:
                    record[key] = delimited.parse_seconds(text)
                except ValueError as error:
                    raise UserError(f"config: record '{record['record']}': {key} {error}") from None
    return listed


def _read_sheet(path: Path) -> list[Record]:
    """Read a record sheet in CSV: the columns of ``RECORD_FIELDS``, empty where there is none."""
    sheet = delimited.read(path, RECORD_FIELDS)
    unknown = [name for name in sheet.columns if name not in RECORD_FIELDS]
    if unknown:
        near = difflib.get_close_matches(unknown[0].lower(), RECORD_FIELDS, n=1)
        hint = f"did you mean '{near[0]}'?" if near else f"known are {', '.join(RECORD_FIELDS)}"
        raise UserError(f"{path}: unknown column '{unknown[0][:40]}'; {hint}")
    if not {"record", "actor"} <= set(sheet.columns):
        raise UserError(f"{path}: columns 'record' and 'actor' are needed; known are {', '.join(RECORD_FIELDS)}")
    listed = []
    for (line, cells), times in zip(sheet.rows, delimited.parse_times(sheet, TIMES, path), strict=True):
        record: Record = {key: cell for key, cell in cells.items() if cell} | times
        if "channel" in record:
            number = re.fullmatch(r"0*([1-9]\d{0,4})(\.0*)?", record["channel"].strip())
            if not number:
                raise UserError(
                    f"{path}: line {line}: channel '{record['channel']}' is not a whole number; count channels from 1"
                )
            record["channel"] = int(number[1])
        if "record" not in record or "actor" not in record:
            raise UserError(f"{path}: line {line}: needs a record and an actor; complete or delete the line")
        for name in (record["record"], record["actor"]):
            if not re.fullmatch(NAME, name):
                raise UserError(
                    f"{path}: line {line}: '{name}' becomes part of a path; take letters, digits, '-' and '_' only"
                )
        for key in FOCAL_LENGTHS:
            if key in record:
                record[key] = _focal_length(record[key], sheet.separator, f"{path}: line {line}: {key}")
        negative = [key for key, time_s in times.items() if time_s < 0]
        if negative:
            raise UserError(f"{path}: line {line}: {negative[0]} is negative; times count from the start of the file")
        listed.append(record)
    if not listed:
        raise UserError(f"{path}: lists no record; add one line per record")
    return listed


def _focal_length(text: str, separator: str, where: str) -> float:
    """Return a focal length that is written in a sheet."""
    try:
        value = delimited.parse_number(text, separator)
    except ValueError as error:
        raise UserError(f"{where} {error}; write a number without a unit") from None
    if value <= 0:
        raise UserError(f"{where} {value:g} is not a focal length; write a positive number")
    return value


def _check_names(listed: list[Record]) -> None:
    for record in listed:
        if record["actor"] == RESERVED or record["scenario"] == RESERVED:
            kind = "actor" if record["actor"] == RESERVED else "scenario"
            raise UserError(
                f"config: record '{record['record']}': '{RESERVED}' stands for every {kind} in the tables of "
                f"results; give this {kind} another name"
            )
        for name in (record["record"], record["actor"]):
            if len(name) > LONGEST_NAME:
                raise UserError(
                    f"config: '{name[:20]}...' is longer than {LONGEST_NAME} characters; shorten this name"
                )


def _check_files(listed: list[Record]) -> None:
    for record in listed:
        for field in (*FILE_FIELDS, "views"):
            if record[field]:
                record[field] = paths.plain(record[field], f"record '{record['record']}': {field}")
        for field in FILE_FIELDS:
            if record[field] and not Path(record[field]).is_file():
                raise MissingFileError(
                    record[field], f"config: record '{record['record']}': no {field} file {record[field]}"
                )
        _check_head(record)
        if record["motion"] and record["views"]:
            raise UserError(f"config: record '{record['record']}' has both motion and views; leave one of them out")
        start, end = record["start_s"] or 0.0, record["end_s"]
        if end is not None and end <= start:
            raise UserError(f"config: record '{record['record']}': end_s {end} is not after start_s {start}")


def _check_head(record: Record) -> None:
    """Raise UserError unless the head of a record comes from one source, and its films with their cameras."""
    name, films = record["record"], [field for field in ("film_left", "film_right") if record[field]]
    if record["head"] and films:
        raise UserError(f"config: record '{name}' has both head and {films[0]}; leave one of them out")
    if films == ["film_right"]:
        raise UserError(f"config: record '{name}' has film_right without film_left; a single film is film_left")
    if len(films) > 1 and not record["film_cameras"]:
        raise UserError(
            f"config: record '{name}': the cameras of its two films must be known; name a camera file (TOML of "
            "Pose2Sim or caliscope) in film_cameras"
        )
    declared = [key for key in FOCAL_LENGTHS if record[key] is not None]
    other = next((field for field in ("film_cameras", "film_right") if record[field]), None)
    if declared and (other or not films):
        fits = f"has {other} as well" if other else "has no film_left"
        raise UserError(
            f"config: record '{name}' {fits}; {declared[0]} is for a single film without a camera file, leave it out"
        )
    _check_declared_once(declared, f"config: record '{name}'")


def _with_focal_length(record: Record, settings: Config) -> Record:
    """Return a record with the focal length of the corpus, if it has a single film of an unknown camera.

    Parameters
    ----------
    settings : the section ``capture.head`` of the configuration.
    """
    known = record["film_right"] or record["film_cameras"] or any(record[key] for key in FOCAL_LENGTHS)
    if not record["film_left"] or known:
        return record
    declared = [key for key in FOCAL_LENGTHS if settings[key] is not None]
    if not declared:
        raise UserError(
            f"config: record '{record['record']}': the focal length of the camera of its film is not known; declare "
            "focal_35mm (35 mm equivalent in mm, which the specifications of a phone state) or focal_px (pixels)"
        )
    _check_declared_once(declared, "config: capture.head")
    return record | {key: settings[key] for key in declared}


def _check_declared_once(declared: Sequence[str], where: str) -> None:
    if len(declared) > 1:
        raise UserError(f"{where} has both {' and '.join(declared)}; leave one of them out")
