"""The configuration: checked wholly before the first job, and what follows from it (records, actors, settings)."""

from __future__ import annotations

import csv
import difflib
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from cospeech.errors import UserError
from cospeech.tables import schema_folder

SCENARIOS = ("memory", "documentary", "fairy_tale", "watch_and_tell")
"""The monologue and watching scenarios of Özkul 2012, 3.2, that the studio's records take in turn."""

RECORD_FIELDS = (
    "record", "actor", "scenario", "language", "motion", "audio",
    "prosody", "gestures", "annotations", "start_s", "end_s",
)  # fmt: skip
FILM_ENDINGS = (".mkv", ".mp4", ".avi", ".mov")
FILE_FIELDS = ("motion", "audio", "prosody", "gestures", "annotations")

Config = dict[str, Any]
Record = dict[str, Any]


class Setting(NamedTuple):
    """One setting of the prosody clusters: number of branches M and of states N."""

    clusters: int
    states: int

    @property
    def path(self) -> str:
        """The part of an artifact's path that names the setting."""
        return f"clusters~{self.clusters}/states~{self.states}"


def in_order(config: Config) -> Config:
    """Return the configuration with its keys sorted at every level: how a file orders them must not rerun a job."""
    return {key: in_order(value) if isinstance(value, dict) else value for key, value in sorted(config.items())}


def check(config: Config) -> None:
    """Raise UserError, one line, unless the configuration has the right keys, types and possible values."""
    # Heavy and needed once: the schema language is imported where it is used.
    from jsonschema import Draft202012Validator

    text = (schema_folder() / "config.yaml").read_text(encoding="utf-8")
    found = sorted(
        Draft202012Validator(yaml.safe_load(text)).iter_errors(config),
        key=lambda error: list(map(str, error.path)),
    )
    if found:
        raise UserError("; ".join(_explain(error) for error in found[:5]))
    for problem in _impossible(config):
        raise UserError(f"config: {problem}")


def _explain(error: Any) -> str:
    """Say one schema violation in plain words, with the nearest known key where one is unknown."""
    place = ".".join(str(part) for part in error.absolute_path) or "top level"
    if error.validator == "additionalProperties":
        known = list(error.schema.get("properties", {}))
        unknown = [key for key in error.instance if key not in known]
        near = difflib.get_close_matches(str(unknown[0]), known, n=1)
        hint = f"did you mean '{near[0]}'?" if near else f"known are {', '.join(known)}"
        return f"config: {place}: unknown key '{unknown[0]}'; {hint}"
    if error.validator in ("anyOf", "oneOf") and error.context:
        deepest = max(error.context, key=lambda inner: len(inner.absolute_path))
        if deepest.absolute_path != error.absolute_path:
            return _explain(deepest)
    return f"config: {place}: {error.message}; see data_schema/config.yaml"


def _impossible(config: Config) -> list[str]:
    """Return what no schema can see: values that contradict one another."""
    problems = []
    speech, evaluation, animation = config["speech"], config["evaluation"], config["animation"]
    if speech["pitch_min_hz"] >= speech["pitch_max_hz"]:
        problems.append("speech: pitch_min_hz must be below pitch_max_hz")
    if speech["window_s"] < speech["frame_s"]:
        problems.append("speech: window_s must be at least frame_s, or samples go unseen")
    if config["synthesis"]["max_duration_s"] < 2 * speech["frame_s"]:
        problems.append("synthesis.max_duration_s must span at least two prosody frames (speech.frame_s)")
    if animation["video"]["shown"] not in animation["systems"]:
        problems.append(f"animation.video.shown '{animation['video']['shown']}' is not in animation.systems")
    if "random" not in animation["systems"]:
        problems.append("animation.systems must contain 'random', which every comparison shows")
    if "rest" not in config["phrases"]["gesture"]["labels"]:
        problems.append("phrases.gesture.labels must contain 'rest', the class that clustering starts from")
    if len(config["run"]) > 60:
        problems.append("run: a name of at most 60 characters, as it becomes a folder")
    corpus = config["corpus"]
    if (corpus["name"] == "virtual") != (corpus["source"] == "studio"):
        problems.append("corpus.name: 'virtual' is the studio's name and only the studio's; name your corpus")
    problems += _impossible_calibration(config["capture"]["calibration"])
    if corpus["source"] == "recorded" and not corpus["records"] and not calibrates(config):
        problems.append("corpus.records is empty: list your records there, or name a CSV file")
    if corpus["source"] == "studio":
        names = [actor["actor"] for actor in config["studio"]["actors"]]
        if len(set(names)) < len(names):
            problems.append("studio.actors: two actors have one name")
        inner = evaluation["interior"]
        shortest = min(actor["duration_s"] for actor in config["studio"]["actors"])
        if inner["head_s"] + inner["tail_s"] >= shortest:
            problems.append(f"evaluation.interior leaves nothing of a record of {shortest} s")
        if not config["studio"]["sound"] and config["phrases"]["gesture"]["first_examples"] == "rules":
            problems.append("phrases.gesture.first_examples: rules need motion, which studio.sound: false leaves out")
        if config["studio"]["film"] and not config["studio"]["sound"]:
            problems.append("studio.film needs studio.sound: without it, records are features and nobody moves")
    return problems


def _impossible_calibration(calibration: Config) -> list[str]:
    problems = []
    method, kinds = calibration["method"], {key for fact in calibration["facts"] for key in fact}
    if method == "board" and not (calibration["films"] and calibration["board"]):
        problems.append("capture.calibration: a board needs films, a folder, and board, the path of its definition")
    if method == "given" and not calibration["file"]:
        problems.append("capture.calibration.file: name the TOML of the calibration that is given")
    if method == "board" and (kinds - {"origin_frame"} or len(calibration["facts"]) > 1):
        problems.append("capture.calibration.facts: a board takes [], or one {origin_frame: ...}")
    return problems


def calibrates(config: Config) -> bool:
    """Return whether the configuration names a calibration of its own, in films or as a file."""
    calibration = config["capture"]["calibration"]
    return calibration["method"] == "given" or bool(calibration["films"])


def calibration_films(config: Config) -> dict[str, str]:
    """Return the films of a calibration take of one's own by camera, sorted; none where it is given or the studio's.

    Raises
    ------
    UserError : where the folder is missing or holds no films, or two of one camera.
    """
    calibration = config["capture"]["calibration"]
    if calibration["method"] == "given" or not calibration["films"]:
        return {}
    folder = Path(calibration["films"])
    films = sorted(path for path in folder.glob("*") if path.suffix.lower() in FILM_ENDINGS)
    if not films:
        raise UserError(
            f"config: capture.calibration.films: {folder} holds no film (<camera>{', '.join(FILM_ENDINGS)}); correct "
            "its path (paths start at the project's folder)"
        )
    twice = [name for name, count in Counter(path.stem for path in films).items() if count > 1]
    if twice:
        raise UserError(
            f"config: capture.calibration.films: {folder} holds two films of camera {twice[0]}; leave one"
        )
    return {path.stem: str(path) for path in films}


def records(config: Config, results: str) -> dict[str, Record]:
    """Return the records by name, each with every field of ``RECORD_FIELDS`` (None where there is none).

    Raises
    ------
    UserError : a record listed twice, without speech or motion, of a missing file, or alone with its actor.
    """
    if config["corpus"]["source"] == "studio":
        listed = _studio_records(config, results)
    else:
        listed = _listed_records(config["corpus"]["records"])
        _check_files(listed)
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
    """Return what every record of the corpus brings: motion or gestures, and audio or prosody; nothing without any.

    Raises
    ------
    UserError : where records differ in it, or one brings nothing.
    """
    kinds = {}
    for name, record in listed.items():
        body = "motion" if record["motion"] else "gestures" if record["gestures"] else None
        voice = "audio" if record["audio"] else "prosody" if record["prosody"] else None
        if body is None or voice is None:
            missing = "motion (or gestures)" if body is None else "audio (or prosody)"
            raise UserError(f"config: record '{name}' has no {missing}; name a file for it in corpus.records")
        kinds[name] = frozenset({body, voice})
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


def main_setting(config: Config) -> Setting:
    """Return the setting that every system runs at."""
    prosody = config["phrases"]["prosody"]
    return Setting(prosody["clusters"], prosody["states"])


def sweep_settings(config: Config) -> list[Setting]:
    """Return the further settings of the sweep, without the main one.

    ``lines`` are the two of fig. 7.2 through the main setting (clusters at its states, states at its clusters);
    ``full`` is every pair.
    """
    sweep, main = config["sweep"], main_setting(config)
    if sweep["grid"] == "full":
        settings = [Setting(clusters, states) for clusters in sweep["clusters"] for states in sweep["states"]]
    else:
        settings = [Setting(clusters, main.states) for clusters in sweep["clusters"]]
        settings += [Setting(main.clusters, states) for states in sweep["states"]]
    return [setting for setting in dict.fromkeys(settings) if setting != main]


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
                filmed = f"{results}/capture/{name}/motion.parquet"
                body = filmed if config["studio"]["film"] else f"{raw}.bvh"
                record |= {"motion": body, "audio": f"{raw}.wav"}
            else:
                record |= {"gestures": f"{raw}.gestures.parquet", "prosody": f"{raw}.prosody.parquet"}
            listed.append(record)
    return listed


def _listed_records(given: str | list[Record]) -> list[Record]:
    if isinstance(given, str):
        given = _read_sheet(Path(given))
    return [dict.fromkeys(RECORD_FIELDS) | record for record in given]


def _read_sheet(path: Path) -> list[Record]:
    """Read a record sheet in CSV: the columns of ``RECORD_FIELDS``, empty where there is none."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file)
            fields = reader.fieldnames or []
            rows = list(reader)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UserError(f"{path}: cannot be read as a CSV sheet of records ({error})") from error
    unknown = [field for field in fields if field not in RECORD_FIELDS]
    if unknown or not {"record", "actor"} <= set(fields):
        problem = f"unknown column '{unknown[0]}'" if unknown else "columns 'record' and 'actor' are needed"
        raise UserError(f"{path}: {problem}; known are {', '.join(RECORD_FIELDS)}")
    listed = []
    for line, row in enumerate(rows, start=2):
        if None in row:
            raise UserError(f"{path}: line {line} has more cells than the heading")
        record: Record = {key: value for key, value in row.items() if value}
        for key in ("start_s", "end_s"):
            if key in record:
                try:
                    record[key] = float(record[key])
                except ValueError:
                    raise UserError(
                        f"{path}: line {line}: {key} '{record[key]}' is not a number of seconds"
                    ) from None
        if "record" not in record or "actor" not in record:
            raise UserError(f"{path}: line {line}: needs a record and an actor")
        listed.append(record)
    return listed


def _check_files(listed: list[Record]) -> None:
    for record in listed:
        for field in FILE_FIELDS:
            if record[field] and not Path(record[field]).is_file():
                raise UserError(
                    f"config: record '{record['record']}': no {field} file {record[field]}; correct its path "
                    "(paths start at the project's folder)"
                )
        start, end = record["start_s"] or 0.0, record["end_s"]
        if end is not None and end <= start:
            raise UserError(f"config: record '{record['record']}': end_s {end} is not after start_s {start}")
