"""The configuration: checked wholly before the first job, and what follows from it (records, actors, settings)."""

from __future__ import annotations

import csv
import difflib
import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from cospeech.data import project
from cospeech.data.tables import schema_folder
from cospeech.data.vocabulary import SCENARIOS
from cospeech.errors import UserError
from cospeech.motion.markers import NAMES

NAME = "[A-Za-z0-9][A-Za-z0-9_-]*"
"""What records and actors may be called, as a regular expression; data_schema/config.yaml says the same."""

RECORD_FIELDS = (
    "record", "actor", "scenario", "language", "motion", "views", "audio",
    "prosody", "gestures", "annotations", "start_s", "end_s",
)  # fmt: skip
FILE_FIELDS = ("motion", "audio", "prosody", "gestures", "annotations")

MARKER_FILES = (".c3d", ".trc")
"""Endings of files that hold markers in the world, where a record enters at the skeleton."""

FILMS = (".mkv", ".mp4", ".mov", ".m4v", ".avi", ".mts", ".m2ts", ".mpg", ".mpeg", ".mxf", ".webm", ".wmv")
"""Endings of films; what else lies in a folder of views is left alone."""

STUDIO_VIEWS = ("c1", "c2", "c3", "c4", "c5")
"""The studio's cameras."""

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

    @property
    def variant(self) -> str:
        """The variant, at this setting, of a system that listens to prosody clusters."""
        return f"clusters~{self.clusters},states~{self.states}"


def in_order(config: Config) -> Config:
    """Return the configuration with its keys sorted at every level: how a file orders them must not rerun a job."""
    return {key: in_order(value) if isinstance(value, dict) else value for key, value in sorted(config.items())}


def defaults() -> Config:
    """Return the settings of the demo, which every other configuration is laid over."""
    text = (project.root() / "config" / "demo.yaml").read_text(encoding="utf-8")
    settings: Config = yaml.safe_load(text)
    return settings


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
    speech, evaluation = config["speech"], config["evaluation"]
    if speech["pitch_min_hz"] >= speech["pitch_max_hz"]:
        problems.append("speech: pitch_min_hz must be below pitch_max_hz")
    if speech["window_s"] < speech["frame_s"]:
        problems.append("speech: window_s must be at least frame_s, or samples go unseen")
    if config["synthesis"]["max_duration_s"] < 2 * speech["frame_s"]:
        problems.append("synthesis.max_duration_s must span at least two prosody frames (speech.frame_s)")
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
    up, facing, names = (corpus["markers"][key] for key in ("up", "facing", "names"))
    if up[-1] == facing[-1]:
        problems.append(f"corpus.markers: up is '{up}' and facing '{facing}'; they must lie along different axes")
    for name in names if isinstance(names, dict) else ():
        if name not in NAMES:
            near = difflib.get_close_matches(name, NAMES, n=1, cutoff=0.0)[0]
            problems.append(f"corpus.markers.names: we have no marker '{name}'; did you mean '{near}'?")
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


def check_systems(config: Config, systems: Mapping[str, Any], brings: frozenset[str]) -> None:
    """Raise UserError where the configuration shows a system that it does not run, or too few to compare.

    Parameters
    ----------
    systems : the systems of the run by name, as the registry returns them.
    brings : what the records bring.
    """
    animation, shown = config["animation"], config["animation"]["video"]["shown"]
    if not any(system.role == "system" for system in systems.values()):
        raise UserError("config: synthesis.systems chooses no system that listens to speech; name at least one")
    for name, system in systems.items():
        if system.makes == "motion" and "motion" not in brings:
            raise UserError(
                f"config: synthesis.systems: '{name}' makes motion, but the records bring none; set it to false"
            )
    for name in animation["systems"]:
        if name not in systems:
            raise UserError(f"config: animation.systems: '{name}' is not among the systems of this run")
    for name in [shown] if isinstance(shown, str) else shown:
        if name not in systems or not (name in animation["systems"] or systems[name].makes == "motion"):
            raise UserError(f"config: animation.video.shown: '{name}' is not in animation.systems")
    if not any(systems[name].role == "control" for name in animation["systems"]):
        raise UserError("config: animation.systems must contain a control, which every comparison shows")


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
    return {Path(path).stem: path for path in films(calibration["films"])}


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


def is_marker_file(path: str | None) -> bool:
    """Return whether a file holds markers in the world, by its ending."""
    return path is not None and Path(path).suffix.lower() in MARKER_FILES


def takes(config: Config, listed: dict[str, Record], results: str) -> dict[str, list[str]]:
    """Return what is to be captured: for each take its marker file, or its films, one of each camera.

    The takes are the records that come as markers or films, by name, and ``range~<actor>``, the range-of-motion take
    of each of their actors.

    Raises
    ------
    UserError : an actor without such a take, or a path where there is no marker file or folder of films.
    """
    given = {
        name: record["views"] or record["motion"]
        for name, record in listed.items()
        if record["views"] or is_marker_file(record["motion"])
    }
    virtual = config["corpus"]["source"] == "studio"
    for name, record in listed.items():
        if record["views"] and not virtual and not calibrates(config):
            raise UserError(
                f"config: record '{name}' comes as films, whose cameras must be known; name films or a file of their "
                "calibration in capture.calibration"
            )
    for actor in dict.fromkeys(listed[name]["actor"] for name in given):
        path = f"{results}/corpus/raw/range~{actor}" if virtual else config["capture"]["ranges"].get(actor)
        if path is None:
            raise UserError(
                f"config: records of actor '{actor}' come as markers or films, which a body model of the actor turns "
                f"into joint angles; name a range-of-motion take, marker file or folder, in capture.ranges.{actor}"
            )
        given[f"range~{actor}"] = path
    if virtual:
        return {take: [f"{path}/{view}.mkv" for view in STUDIO_VIEWS] for take, path in given.items()}
    found = {take: _marker_file(path) if is_marker_file(path) else films(path) for take, path in given.items()}
    _check_offsets(config["capture"]["offsets_s"], found)
    return found


def _check_offsets(given: Config, found: dict[str, list[str]]) -> None:
    """Raise UserError where an offset is that of no take, or of a view that the take does not have."""
    views = {take: [Path(path).stem for path in paths] for take, paths in found.items()}
    every = sorted({view for names in views.values() for view in names})
    for key, value in given.items():
        if isinstance(value, dict) and key not in views:
            raise UserError(f"config: capture.offsets_s: no take is called '{key}'; takes are {', '.join(views)}")
        known, asked = (views[key], list(value)) if isinstance(value, dict) else (every, [key])
        for view in asked:
            if view not in known:
                raise UserError(
                    f"config: capture.offsets_s: no view is called '{view}'; views are {', '.join(known)}"
                )


def _marker_file(path: str) -> list[str]:
    if not Path(path).is_file():
        raise UserError(f"config: no marker file {path}; correct its path (paths start at the project's folder)")
    return [path]


def offsets_s(config: Config, take: str) -> dict[str, float]:
    """Return how much later the views of a take began, where a person says so: under its name, or for every take."""
    given = config["capture"]["offsets_s"]
    of_all = {view: seconds for view, seconds in given.items() if not isinstance(seconds, dict)}
    own: dict[str, float] = given.get(take, {})
    return of_all | own


def films(folder: str) -> list[str]:
    """Return the films in a folder, each named as its camera, in the order of these names.

    Raises
    ------
    UserError : no such folder, no film in it, or two of one camera.
    """
    if not Path(folder).is_dir():
        raise UserError(
            f"config: {folder}: no such folder of films, and no marker file ({', '.join(MARKER_FILES)}); correct its "
            "path (paths start at the project's folder)"
        )
    found = sorted(path for path in Path(folder).glob("[!.]*") if path.suffix.lower() in FILMS)
    if not found:
        raise UserError(f"config: {folder}: no film lies there; known are {', '.join(FILMS)}")
    for name, count in Counter(path.stem for path in found).items():
        if count > 1:
            raise UserError(f"config: {folder}: two films are called '{name}'; leave one for each camera")
    return [str(path) for path in found]


def brings(listed: dict[str, Record]) -> frozenset[str]:
    """Return what every record of the corpus brings: motion or gestures, and audio or prosody; nothing without any.

    Raises
    ------
    UserError : where records differ in it, or one brings nothing.
    """
    kinds = {}
    for name, record in listed.items():
        body = "motion" if record["motion"] or record["views"] else "gestures" if record["gestures"] else None
        voice = "audio" if record["audio"] else "prosody" if record["prosody"] else None
        if body is None or voice is None:
            missing = "motion (or views, or gestures)" if body is None else "audio (or prosody)"
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
                body = {"views": raw} if config["studio"]["film"] else {"motion": f"{raw}.bvh"}
                record |= body | {"audio": f"{raw}.wav"}
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
        for name in (record["record"], record["actor"]):
            if not re.fullmatch(NAME, name):
                raise UserError(
                    f"{path}: line {line}: '{name}' becomes part of a path; take letters, digits, '-' and '_' only"
                )
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
        if record["motion"] and record["views"]:
            raise UserError(f"config: record '{record['record']}' has both motion and views; leave one of them out")
        start, end = record["start_s"] or 0.0, record["end_s"]
        if end is not None and end <= start:
            raise UserError(f"config: record '{record['record']}': end_s {end} is not after start_s {start}")
