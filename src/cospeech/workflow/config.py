"""The configuration, checked completely before the first job."""

from __future__ import annotations

import difflib
import functools
import json
import math
from collections.abc import Collection, Iterator, Mapping
from typing import Any, NamedTuple

import yaml

from cospeech.data import project
from cospeech.data.tables import schema_folder
from cospeech.errors import UserError
from cospeech.motion.markers import NAMES
from cospeech.workflow.takes import calibrates

Config = dict[str, Any]

KINDS = {int: "number", float: "number", bool: "truth value", type(None): "null"}
"""What YAML takes words for that are not in quotation marks; anything else is a date."""


MOST_RECORDS = 10_000
MOST_HOURS = 1_000
"""The largest virtual corpus. Beyond it, planning alone would take minutes and gigabytes."""

ANY_SETTINGS = {"type": "object"}
"""The schema of the settings of one system: their names and types are not known here. Whole numbers in it are made
integers, which settings of other numbers accept, too."""


class ActorWorld(NamedTuple):
    """What is planted in the records of one actor of the studio.

    Attributes
    ----------
    world : what depends on speech.
    coupling : how much of it does, 0 to 1.
    couplings : coupling of single parts of the world ``all``, where it differs.
    head : coupling of the gestures of the head in worlds other than ``patterns``, None if it has none.
    """

    world: str
    coupling: float
    couplings: dict[str, float]
    head: float | None = None


def actor_worlds(studio: Config) -> dict[str, ActorWorld]:
    """Return the world of each actor, from the section ``studio`` of a configuration.

    An actor without a world or coupling of its own has that of the studio. The couplings of single parts apply to
    actors in the world ``all`` that have no coupling of their own.
    """
    return {
        actor["actor"]: ActorWorld(
            world := actor.get("world", studio["world"]),
            actor.get("coupling", studio["coupling"]),
            dict(studio["couplings"]) if world == "all" and "coupling" not in actor else {},
            actor.get("head_coupling", studio["head_coupling"]),
        )
        for actor in studio["actors"]
    }


def identifies(config: Config) -> bool:
    """Return whether a run identifies speakers by voice and lips, and has no actors."""
    return bool(config["identity"]["population"] or config["identity"]["sheet"])


def gives_directions(config: Config) -> bool:
    """Return whether a run is about keywords, accents and gestures in route directions, and has no actors."""
    return bool(config["directions"]["corpus"])


@functools.cache
def schema() -> Config:
    """Return the JSON Schema of a complete configuration."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    loaded: Config = yaml.load((schema_folder() / "config.yaml").read_text(encoding="utf-8"), Loader=loader)
    return loaded


def in_order(config: Config) -> Config:
    """Return the configuration with its keys sorted at every level: how a file orders them must not rerun a job."""
    return {key: in_order(value) if isinstance(value, dict) else value for key, value in sorted(config.items())}


def normalised(config: Config) -> Config:
    """Return the configuration with numbers of the type that the schema asks for.

    Where it asks for a whole number, 4.0 becomes 4: R writes whole numbers like this. Where it asks for text, a whole
    number becomes its digits, and so does every key: a view may be called 1.
    """
    found: Config = _normalised(config, schema())
    return found


def _normalised(value: Any, part: Mapping[str, Any]) -> Any:
    while "$ref" in part:
        part = schema()["$defs"][part["$ref"].rpartition("/")[2]]
    for choice in part.get("anyOf", ()):
        value = _normalised(value, choice)
    kinds = part.get("type", ())
    if isinstance(value, dict):
        known, others = part.get("properties", {}), part.get("additionalProperties") or {}
        if part == ANY_SETTINGS:
            others = {"type": "integer"}
        keys = {key: str(key) if isinstance(key, int) and not isinstance(key, bool) else key for key in value}
        return {keys[key]: _normalised(one, known.get(keys[key], others)) for key, one in value.items()}
    if isinstance(value, list):
        return [_normalised(one, part.get("items", {})) for one in value]
    if isinstance(value, float) and value.is_integer() and "integer" in kinds:
        return int(value)
    if isinstance(value, int) and not isinstance(value, bool) and kinds == "string":
        return str(value)
    return value


def defaults() -> Config:
    """Return the settings of the demo, which every other configuration is laid over."""
    text = (project.root() / "config" / "demo.yaml").read_text(encoding="utf-8")
    settings: Config = yaml.safe_load(text)
    return settings


def check(config: Config) -> None:
    """Raise UserError, one line, unless the configuration has the right keys, types and possible values."""
    # Heavy and needed once: the schema language is imported where it is used.
    from jsonschema import Draft202012Validator

    for place, number in _numbers(config):
        if not math.isfinite(number):
            raise UserError(f"config: {place}: {number} is not a finite number; write one")
    found = sorted(
        Draft202012Validator(schema()).iter_errors(config),
        key=lambda error: list(map(str, error.path)),
    )
    if found:
        raise UserError(" ".join("; ".join(_explain(error) for error in found[:5]).split()))
    for problem in _impossible(config):
        raise UserError(f"config: {problem}")


def check_labels(config: Config, brings: frozenset[str]) -> None:
    """Raise UserError unless a gesture model can start from the class ``rest``; delivered gestures need no model."""
    if "motion" in brings and "rest" not in config["phrases"]["gesture"]["labels"]:
        raise UserError(
            "config: phrases.gesture.labels must contain 'rest', the class that clustering starts from, unless all "
            "records come with their gestures"
        )


def check_systems(config: Config, systems: Mapping[str, Any], failed: Collection[str] = ()) -> None:
    """Raise UserError where the configuration shows a system that it does not run, or too few to compare.

    Parameters
    ----------
    systems : the systems of the run by name, as the registry returns them.
    failed : names of systems that could not be loaded. They can be named, and are left out.
    """
    animation, shown = config["animation"], config["animation"]["video"]["shown"]
    whole = [system for system in systems.values() if system.makes != "head"]
    if not any(system.role == "system" for system in whole or systems.values()):
        raise UserError("config: synthesis.systems chooses no system that listens to speech; name at least one")
    if not whole:
        return  # there are heads alone, and no video of a body
    for name in animation["systems"]:
        if name not in systems and name not in failed:
            raise UserError(f"config: animation.systems: '{name}' is not among the systems of this run")
    for name in [shown] if isinstance(shown, str) else shown:
        if name in failed or (name in config["synthesis"]["systems"] and name not in systems):
            continue  # it cannot run, or is switched off: the videos show the others
        if name not in systems or not (name in animation["systems"] or systems[name].makes == "motion"):
            raise UserError(f"config: animation.video.shown: '{name}' is not in animation.systems")
    if not any(systems[name].role == "control" for name in animation["systems"] if name in systems):
        raise UserError("config: animation.systems must contain a control, which every comparison shows")


def _numbers(value: Any, place: str = "") -> Iterator[tuple[str, float]]:
    """Yield every floating point number of the configuration, with the place where it is."""
    if isinstance(value, float):
        yield place, value
    elif isinstance(value, dict | list):
        for key, one in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _numbers(one, f"{place}.{key}" if place else str(key))


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
    value, expected = repr(error.instance), error.validator_value
    if error.validator == "pattern" and error.schema == schema()["$defs"]["name"]:
        return f"config: {place}: {value} is not a name; use letters, digits, '-' and '_', and begin with no sign"
    if error.validator == "type" and expected == "string" and not isinstance(error.instance, dict | list):
        return (
            f"config: {place}: YAML reads {json.dumps(error.instance, default=str)} as a "
            f"{KINDS.get(type(error.instance), 'date')}, not as text; write it in quotation marks"
        )
    message = error.message.replace(value, f"{value[:60]} ...") if len(value) > 80 else error.message
    return f"config: {place}: {message}; see data_schema/config.yaml"


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
    if len(config["run"]) > 60:
        problems.append("run: a name of at most 60 characters, as it becomes a folder")
    if config["run"] == "template":
        problems.append("run: reports/template holds the templates of the report; choose another name")
    corpus = config["corpus"]
    if (corpus["name"] == "virtual") != (corpus["source"] == "studio"):
        problems.append("corpus.name: 'virtual' is the studio's name and only the studio's; name your corpus")
    problems += _impossible_calibration(config["capture"]["calibration"])
    problems += _impossible_identity(config)
    problems += _impossible_directions(config)
    if corpus["source"] == "recorded" and not (corpus["records"] or calibrates(config) or identifies(config)):
        problems.append("corpus.records is empty: list your records there, or name a CSV file")
    up, facing, names = (corpus["markers"][key] for key in ("up", "facing", "names"))
    if up[-1] == facing[-1]:
        problems.append(f"corpus.markers: up is '{up}' and facing '{facing}'; they must lie along different axes")
    up, facing = (corpus["head"][key] for key in ("up", "facing"))
    if up[-1] == facing[-1]:
        problems.append(f"corpus.head: up is '{up}' and facing '{facing}'; they must lie along different axes")
    for name in names if isinstance(names, dict) else ():
        if name not in NAMES:
            near = difflib.get_close_matches(name, NAMES, n=1, cutoff=0.0)[0]
            problems.append(f"corpus.markers.names: we have no marker '{name}'; did you mean '{near}'?")
    if corpus["source"] == "studio":
        if "rest" not in config["phrases"]["gesture"]["labels"]:
            problems.append("phrases.gesture.labels must contain 'rest', which every actor of the studio does")
        names = [actor["actor"] for actor in config["studio"]["actors"]]
        if len(set(names)) < len(names):
            problems.append("studio.actors: two actors have one name")
        n_records = sum(actor["records"] for actor in config["studio"]["actors"])
        hours = sum(actor["records"] * actor["duration_s"] for actor in config["studio"]["actors"]) / 3600
        if n_records > MOST_RECORDS or hours > MOST_HOURS:
            problems.append(
                f"studio.actors: {n_records:,} records of {hours:,.0f} hours; at most {MOST_RECORDS:,} records and "
                f"{MOST_HOURS:,} hours can be planned"
            )
        inner = evaluation["interior"]
        shortest = min(actor["duration_s"] for actor in config["studio"]["actors"])
        if inner["head_s"] + inner["tail_s"] >= shortest:
            problems.append(f"evaluation.interior leaves nothing of a record of {shortest} s")
        studio = config["studio"]
        if studio["sound"] and studio["motion"]:
            problems.append("studio.motion: records with sound always have motion; set it to false")
        if not (studio["sound"] or studio["motion"]):
            if config["phrases"]["gesture"]["first_examples"] == "rules":
                problems.append(
                    "phrases.gesture.first_examples: rules need motion, which studio.sound: false leaves out"
                )
            moving = [own.world for own in actor_worlds(studio).values() if own.world not in ("phrases", "patterns")]
            if moving:
                problems.append(f"studio.world: '{moving[0]}' is about how the body moves; set studio.motion to true")
        if studio["couplings"] and not any(own.couplings for own in actor_worlds(studio).values()):
            problems.append("studio.couplings are those of the parts of the world 'all'; use studio.coupling")
        if studio["film"] and not studio["sound"]:
            problems.append("studio.film needs studio.sound: without it, nobody is filmed")
        unmoved = [name for name, own in actor_worlds(studio).items() if own.world != "patterns" and own.head is None]
        if studio["film"] == "stereo" and unmoved:
            problems.append(
                f"studio.film: stereo films head gestures, and '{unmoved[0]}' has none; choose the world 'patterns' "
                "for this actor, or set studio.head_coupling"
            )
    return problems


def _impossible_identity(config: Config) -> list[str]:
    problems = []
    identity, virtual = config["identity"], config["corpus"]["source"] == "studio"
    if identity["population"] and identity["sheet"]:
        problems.append("identity: population and sheet exclude each other; set population to false or sheet to null")
    if identity["population"] and not virtual:
        problems.append("identity.population is the studio's; leave corpus.source at studio, or name a sheet instead")
    if identity["sheet"] and virtual:
        problems.append("identity.sheet lists recorded clips; set corpus.source to recorded and name your corpus")
    if identity["population"]:
        own = config["studio"]["population"]
        if own["repetitions"] < 2:
            problems.append("studio.population.repetitions: with one, nothing is left to test; take 2 or more")
        if own["others"] >= min(own["speakers"], identity["populations"]["speakers"]):
            problems.append(
                f"studio.population.others: there are not {own['others']} names of other speakers; take fewer, or "
                "more speakers (also in identity.populations)"
            )
    return problems


def _impossible_directions(config: Config) -> list[str]:
    if not gives_directions(config):
        return []
    problems = []
    if config["corpus"]["source"] != "studio":
        problems.append("directions.corpus is the studio's; leave corpus.source at studio")
    if identifies(config):
        problems.append("directions.corpus and identity exclude each other; choose one of them")
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
