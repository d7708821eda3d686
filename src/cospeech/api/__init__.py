"""The functions that a notebook needs: load records, measure prosody, train, synthesize, score and write BVH.

They do what the workflow does, on tables in memory: a motion table has one row per frame, a segment table one row per
gesture phrase. ``data_schema`` describes their columns.

Examples
--------
From speech to motion with the small model that comes with the package:

>>> from cospeech import api
>>> model = api.load_model()
>>> performance = api.synthesize("speech.wav", model)
>>> api.write_bvh(performance.motion, "speech.bvh")
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech import __version__
from cospeech.api.heads import HeadModel, HeadPerformance, load_head_model, synthesize_head
from cospeech.api.trained import check_tables, system_of_model
from cospeech.corpus import any_body, intake
from cospeech.corpus.retarget import MotionConventions
from cospeech.data import segments, tables, vocabulary
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.evaluation import scores
from cospeech.formats import audio, bvh
from cospeech.formats import sound as wav
from cospeech.formats.sound import RATE_HZ
from cospeech.markov import labelled_hmm
from cospeech.markov.labelled_hmm import LabelledHMM
from cospeech.motion import assembly, skeleton, unit_selection
from cospeech.motion.body import STANDARD
from cospeech.motion.library import Library
from cospeech.segmentation import gesture, phases, subunits
from cospeech.segmentation import prosody as clustering
from cospeech.speech import prosody as measuring
from cospeech.speech import syllables
from cospeech.synthesis.controller import model as controller
from cospeech.synthesis.controller.model import Segments
from cospeech.synthesis.declaration import System
from cospeech.synthesis.interface import Speech
from cospeech.synthesis.registry import installed
from cospeech.synthesis.session import Session, Trained, method_of, naming, perform
from cospeech.synthesis.training import Actor, fold
from cospeech.workflow import config, model_folder, sweep
from cospeech.workflow import records as record_list

__all__ = [
    "BUNDLED",
    "ActorModel",
    "HeadModel",
    "HeadPerformance",
    "MotionLibrary",
    "Performance",
    "Record",
    "Settings",
    "default_settings",
    "load_head_model",
    "load_model",
    "load_record",
    "motion_library",
    "prosody",
    "record_of_run",
    "score",
    "synthesize",
    "synthesize_head",
    "system_of_model",
    "train",
    "with_keywords",
    "write_bvh",
]

BUNDLED = Path(__file__).parents[1] / "bundled_model"
"""The model of a virtual actor that comes with the package."""

Settings = Mapping[str, Any]
"""A complete configuration, as ``default_settings`` returns it."""


class Record(NamedTuple):
    """A recording of an actor who talks.

    Attributes
    ----------
    name : name of the record.
    motion : motion table (schema ``motion``).
    prosody : prosody features of the speech (schema ``prosody``).
    sound : (n,) the speech at 16 kHz, full scale 1; None if the record came with a prosody table instead.
    """

    name: str
    motion: pd.DataFrame
    prosody: pd.DataFrame
    sound: Floats | None


class ActorModel(NamedTuple):
    """A system trained on an actor's records, with everything needed to synthesize motion for new speech.

    Attributes
    ----------
    card : what the model is and which settings it uses (see docs/models.md).
    system : the declaration of its system.
    trained : the method of the system and its trained model.
    gesture_model : the model that finds gesture phrases in motion.
    prosody_model : the model that finds prosody clusters in speech.
    gestures : gesture phrases of the training records (schema ``segments``).
    motions : motion table of each training record; with ``gestures``, the motion library.
    """

    card: Mapping[str, Any]
    system: System
    trained: Trained
    gesture_model: LabelledHMM
    prosody_model: LabelledHMM
    gestures: pd.DataFrame
    motions: Mapping[str, pd.DataFrame]


class Performance(NamedTuple):
    """What a model synthesizes for speech.

    Attributes
    ----------
    phrases : gesture phrases (schema ``segments``), as planned or, if the system makes motion, as seen in the motion.
    motion : motion table (schema ``motion``).
    decoding : one row that describes how the phrases were found (schema ``decoding``).
    sound : (n,) the speech at 16 kHz, full scale 1.
    """

    phrases: pd.DataFrame
    motion: pd.DataFrame
    decoding: pd.DataFrame
    sound: Floats


def default_settings() -> dict[str, Any]:
    """Return the settings of the demo, the defaults of every configuration.

    Examples
    --------
    >>> settings = api.default_settings()
    >>> settings["speech"]["frame_s"]
    0.025
    """
    return config.defaults()


def load_record(
    motion: str | Path,
    sound: str | Path,
    name: str | None = None,
    *,
    channel: int | None = None,
    conventions: Mapping[str, Any] | None = None,
    settings: Settings | None = None,
) -> Record:
    """Load a record from a motion file and its wav file, trimmed to their common duration.

    Parameters
    ----------
    motion : BVH file, SMPL-X file (npz), or motion table (parquet, csv).
    sound : wav file.
    name : name of the record; by default that of the motion file.
    channel : channel of the wav file to use, counted from 1; by default all channels are mixed down to one.
    conventions : how to read the motion file: up, unit, joints and zero, as in the section ``corpus.motion`` of the
        configuration. By default, files have the skeleton of cospeech, in metres.
    settings : configuration; by default that of the demo.

    Raises
    ------
    UserError : if a file cannot be read, or motion and sound do not belong together.

    Examples
    --------
    >>> record = api.load_record("talk_1.bvh", "talk_1.wav")
    >>> record.name, len(record.motion), len(record.prosody), len(record.sound)
    ('talk_1', 240, 480, 192000)
    """
    used = settings or default_settings()
    name = name or Path(motion).stem
    entry = dict.fromkeys(record_list.RECORD_FIELDS) | {
        "record": name,
        "actor": name,
        "motion": str(motion),
        "audio": str(sound),
        "channel": channel,
    }
    read = intake.read_record(
        entry,
        str(motion),
        0.0,
        MotionConventions(**(conventions or used["corpus"]["motion"])),
        used["phrases"]["gesture"]["labels"],
        used["speech"]["frame_s"],
        used["corpus"]["length_tolerance_s"],
    )
    assert read.body is not None  # a motion file was named
    samples = wav.to_16_bit(np.asarray(read.voice)) / wav.FULL_SCALE
    return Record(name, read.body, prosody(samples, settings=used, record=name), samples)


def record_of_run(folder: str | Path, name: str) -> Record:
    """Load a record from the results of a workflow run.

    Parameters
    ----------
    folder : the results of the run, ``results/<run>``.
    name : name of the record.

    Raises
    ------
    UserError : if the run has not computed the motion and prosody of such a record.

    Examples
    --------
    >>> record = api.record_of_run("results/demo", "ada_1")
    >>> record.motion[["time_s", "left_forearm_x_deg"]].shape
    (240, 2)
    """
    place = Path(folder)
    path = place / "corpus" / "audio" / f"{name}.wav"
    return Record(
        name,
        tables.read(place / "motion" / f"{name}.parquet", "motion"),
        tables.read(place / "speech" / name / "prosody.parquet", "prosody"),
        wav.read(path).samples if path.is_file() else None,
    )


def prosody(sound: str | Path | Floats, *, settings: Settings | None = None, record: str = "speech") -> pd.DataFrame:
    """Measure the prosody features of speech (Özkul 2012, 4.2).

    Parameters
    ----------
    sound : a sound file, or (n,) samples at 16 kHz, full scale 1.
    settings : configuration; by default that of the demo.
    record : name of the record in error messages.

    Returns
    -------
    Table of schema ``prosody``: one row per frame of 25 ms, with intensity, pitch and their derivatives.

    Raises
    ------
    UserError : if the sound cannot be read, or is not speech.

    Examples
    --------
    >>> table = api.prosody("speech.wav")
    >>> len(table), round(float(table["intensity"].std(ddof=0)), 6)
    (400, 1.0)
    """
    how = dict((settings or default_settings())["speech"])
    voiced_gain = how.pop("voiced_gain")
    frames = measuring.measure(audio.samples(sound, None), RATE_HZ, **how)
    return measuring.features(frames, measuring.statistics(record, frames, voiced_gain), how["frame_s"])


def train(
    records: Sequence[Record],
    system: str | None = None,
    *,
    annotations: pd.DataFrame | None = None,
    settings: Settings | None = None,
    actor: str = "actor",
) -> ActorModel:
    """Train a system on the records of one actor.

    Parameters
    ----------
    records : records of the actor.
    system : name of an installed system; by default the one that the videos of the demo show.
    annotations : annotated examples of gesture phrases (schema ``annotations``); by default, first examples are
        proposed from the joint angles (``first_examples: rules``).
    settings : configuration; by default that of the demo.
    actor : name of the actor on the card of the model.

    Raises
    ------
    UserError : if there is no such system, or the records are not sufficient.

    Examples
    --------
    >>> records = [api.load_record(f"{name}.bvh", f"{name}.wav") for name in ("talk_1", "talk_2")]
    >>> model = api.train(records)
    >>> model.card["system"], model.card["variant"]
    ('hsmm_weighted', 'clusters~8,states~3')
    >>> len(api.synthesize("speech.wav", model).motion)
    200
    """
    if not records:
        raise UserError("no records to train on; load at least one")
    used = settings or default_settings()
    shown = used["animation"]["video"]["shown"]
    declared = installed(system or (shown if isinstance(shown, str) else shown[0]))
    names = [record.name for record in records]
    motions = {record.name: record.motion for record in records}
    how = used["phrases"]["gesture"]
    if annotations is None:
        how = how | {"first_examples": "rules"}
        annotations = pd.DataFrame({name: [] for name in ("record", "start_s", "end_s", "gesture", "origin")})
    gestures_model = gesture.train(motions, annotations, how).model
    found = [gesture.phrases(gestures_model, name, motion, annotations) for name, motion in motions.items()]
    gestures = pd.concat(found, ignore_index=True)
    setting, frame_s = sweep.main_setting(dict(used)), used["speech"]["frame_s"]
    measured = {record.name: record.prosody for record in records}
    clusters = clustering.train(list(measured.values()), *setting, used["phrases"]["prosody"], used["seed"])
    clustered = clustering.phrases(clusters.model, measured, frame_s)
    known = Actor(actor, names, frame_s, how["labels"], vocabulary.prosody_labels(setting.clusters))
    training, _ = fold(
        known, None, gestures, clustered, measured, motions, **_segmented(declared, records, used["segmentation"])
    )
    shared = {key: value for key, value in used["synthesis"].items() if key != "systems"}
    trained = Session(training, shared, used["synthesis"]["systems"]).trained(declared)
    card = {
        "system": declared.name,
        "variant": setting.variant if "prosody_labels" in declared.needs else "main",
        "actor": actor,
        "held_out": None,
        "records": names,
        "version": __version__,
        "speech": used["speech"],
        "seed": used["seed"],
        "continuity_weight": used["animation"]["continuity_weight"],
        "smoothing": used["animation"]["smoothing"],
        "motion_fps": skeleton.frame_rate(records[0].motion),
    }
    return ActorModel(card, declared, trained, gestures_model, clusters.model, gestures, motions)


def _segmented(system: System, records: Sequence[Record], how: Mapping[str, Any]) -> dict[str, Any]:
    """Return the syllables, phases and subunits of records, as far as a system needs them."""
    found: dict[str, Any] = {}
    motions = {record.name: record.motion for record in records}
    if "syllables" in system.needs:
        silent = [record.name for record in records if record.sound is None]
        if silent:
            raise UserError(f"record {silent[0]}: has no sound, in which {system.name} would look for syllables")
        found["syllables"] = {
            record.name: syllables.table(record.name, syllables.find(np.asarray(record.sound), RATE_HZ))
            for record in records
        }
    if "phases" in system.needs:
        found["phases"] = phases.find(motions, how["phases"])
    if "subunits" in system.needs:
        found["subunits"] = subunits.find(motions, how["subunits"])
    return found


def load_model(folder: str | Path | None = None) -> ActorModel:
    """Load a model that was trained by ``cospeech run models``.

    Parameters
    ----------
    folder : folder of the model; by default the bundled model of a virtual actor.

    Raises
    ------
    UserError : if the folder contains no model, or the model is incomplete, damaged, or of another version.

    Examples
    --------
    >>> model = api.load_model()
    >>> model.card["actor"], model.card["corpus"]
    ('ada', 'virtual')
    """
    place = Path(folder or BUNDLED)
    system = system_of_model(place)
    if system.makes == "head":
        raise UserError(f"{place}: a model of '{system.name}', which moves the head alone; see api.load_head_model")
    read = model_folder.read(place)
    check_tables(place, system, read, ("gestures", "gesture_model", "prosody_model"))
    with naming(system):
        method = method_of(system)
        recorded = {name: table for name, table in read.tables.items() if name.startswith("motion~")}
        own = {name: read.tables[name] for name in system.tables}
        trained = Trained(method, method.from_tables(own | (recorded if "motion" in system.needs else {})))
    motions = {name.removeprefix("motion~"): table for name, table in recorded.items()}
    gesture_model, prosody_model = (
        labelled_hmm.from_table(read.tables[name]) for name in ("gesture_model", "prosody_model")
    )
    return ActorModel(read.card, system, trained, gesture_model, prosody_model, read.tables["gestures"], motions)


class MotionLibrary(NamedTuple):
    """The motion of a folder, for a gesture controller.

    Attributes
    ----------
    folder : the recordings, their body and its hands.
    segments : the motion segments, on the time steps of a controller.
    """

    folder: any_body.Folder
    segments: Segments


def motion_library(
    folder: str | Path,
    *,
    unit: str = "m",
    up: str = "y",
    hands: Sequence[str] = (),
    settings: Settings | None = None,
) -> MotionLibrary:
    """Read a folder of BVH or GLB files of one body, human or not, as a library for a gesture controller.

    Gestures are movements of the hands. Their positions are scaled by the ratio of the lengths of arms to those of
    people, whose kinematics the controller knows (Levine et al. 2010, 9.2).

    Parameters
    ----------
    unit, up : unit of length of BVH files (m, cm, mm or in), and their axis that points up (y or z).
    hands : joints that gesture; by default, the hands of a person, or else the end effectors that move fastest.
    settings : configuration; by default that of the demo.

    Raises
    ------
    UserError : if there is no motion, the files move different bodies, or there are fewer than two segments.

    Examples
    --------
    >>> found = api.motion_library(".")
    >>> found.folder.hands
    ('left_hand', 'right_hand')
    """
    found = any_body.read(Path(folder), unit, up, hands)
    scale = any_body.reach_m(STANDARD, any_body.HUMAN_HANDS) / any_body.reach_m(found.body, found.hands)
    places = {name: scale * any_body.places(found, name) for name in found.recordings}
    rates = dict.fromkeys(places, found.fps)
    active = phases.of_hands(places, rates, (settings or default_settings())["segmentation"]["phases"])
    made = controller.on_steps(Library(active, found.recordings, found.fps, found.body), active)
    if len(made.kinematics) < 2:
        raise UserError(
            f"{folder}: its motion has only one segment, and a controller needs several to choose from; add motion "
            "in which the hands move and rest"
        )
    return MotionLibrary(found, made)


def with_keywords(model: ActorModel, keywords: Mapping[str, Sequence[int]]) -> ActorModel:
    """Return a gesture controller that shows certain segments of its motion library when it hears certain words.

    Parameters
    ----------
    model : the model of a gesture controller.
    keywords : segments that each keyword calls for, as numbered in the table ``library`` of the model. They replace
        the keywords that the model has.

    Raises
    ------
    UserError : if the model is not a gesture controller that runs live, or a keyword has no segment of its library.

    Examples
    --------
    The bundled model is not a controller:

    >>> api.with_keywords(api.load_model(), {"left": [3, 7]})
    Traceback (most recent call last):
    cospeech.errors.UserError: keywords need a model of 'controller', and this is one of 'hsmm_sampled'
    """
    if model.system.model != "controller" or not model.system.live:
        raise UserError(f"keywords need a model of 'controller', and this is one of '{model.system.name}'")
    changed = controller.with_library(model.trained.model, None, keywords)
    return model._replace(trained=model.trained._replace(model=changed))


def synthesize(
    sound: str | Path | Floats,
    model: ActorModel,
    *,
    record: str | None = None,
    seed: int | None = None,
    channel: int | None = None,
    body: pd.DataFrame | None = None,
    words: pd.DataFrame | None = None,
) -> Performance:
    """Synthesize gestures for speech.

    Parameters
    ----------
    sound : a sound file or a video with sound, or (n,) samples at 16 kHz, full scale 1.
    model : the model of an actor.
    record : name of the result; by default that of the file. Random draws depend on the seed and on this name.
    seed : seed of random draws; by default that of the run that trained the model.
    channel : channel of the file to use, counted from 1; by default all channels are mixed down to one.
    body : motion table that hips, spine, head and legs are taken from, as long as the sound; by default the body
        stands still.
    words : the words of the speech with their times (schema ``words``), for a gesture controller with keywords: each
        keyword calls for its gestures when it has been spoken.

    Returns
    -------
    Phrases and motion that last as long as the sound, to the frame.

    Raises
    ------
    UserError : if the sound cannot be read or is not speech, ``body`` is longer or shorter than the sound, or
        ``words`` contains no keyword of the model, or continues after the end of the sound.

    Examples
    --------
    >>> performance = api.synthesize("speech.wav", api.load_model(), seed=1)
    >>> len(performance.sound) / 16000, len(performance.motion) / 25
    (10.0, 10.0)
    >>> float(performance.phrases["end_s"].iloc[-1])
    10.0
    """
    samples = audio.samples(sound, channel)
    name = record or ("speech" if isinstance(sound, np.ndarray) else Path(sound).stem)
    card, fps = model.card, float(model.card["motion_fps"])
    table = prosody(samples, settings=card, record=name)
    frame_s = card["speech"]["frame_s"]
    clusters = labelled_hmm.phrases(model.prosody_model, name, table, 1.0 / frame_s)
    n_frames = max(1, round(len(samples) / RATE_HZ * fps))
    if body is not None:
        _check_body(body, len(samples) / RATE_HZ, fps)
        n_frames = len(body)
    speech = Speech(
        name,
        frame_s,
        len(table),
        labels=segments.to_labels(clusters),
        prosody=table,
        syllables=syllables.table(name, syllables.find(samples, RATE_HZ)),
        words=None if words is None else _keywords_in(words, model, len(samples) / RATE_HZ),
        driving_record=name,
        motion_fps=fps,
        n_motion_frames=n_frames,
    )
    made = perform(model.system, model.trained, speech, card["seed"] if seed is None else seed)
    if made.motion is not None:
        seen = gesture.unconstrained_phrases(model.gesture_model, name, made.motion)
        return Performance(seen, made.motion, made.decoding, samples)
    assert made.phrases is not None  # a system makes one or the other
    pool = unit_selection.templates(model.gestures, model.motions)
    units = unit_selection.select(made.phrases, pool, n_frames, fps, card["continuity_weight"])
    own = skeleton.standing(n_frames, fps) if body is None else body
    motion = assembly.motion(units, pool, model.motions, own, **card["smoothing"])
    return Performance(made.phrases, motion, made.decoding, samples)


def score(actual: pd.DataFrame, synthesised: pd.DataFrame, *, settings: Settings | None = None) -> pd.DataFrame:
    """Score synthesised gesture phrases against the actual ones of the same record.

    Parameters
    ----------
    actual, synthesised : segment tables.
    settings : configuration; by default that of the demo.

    Returns
    -------
    Table of schema ``record_scores`` without system and record: measure, part, gesture, bin_s and value.

    Examples
    --------
    >>> model = api.load_model()
    >>> one, other = (api.synthesize("speech.wav", model, seed=seed).phrases for seed in (1, 2))
    >>> table = api.score(one, other)
    >>> whole = table[table["part"] == "whole"].set_index("measure")["value"]
    >>> bool(-1 <= whole["kappa"] <= 1)
    True
    """
    used = settings or default_settings()
    rules = scores.Rules(
        gestures=tuple(used["phrases"]["gesture"]["labels"]),
        bins_s=tuple(used["evaluation"]["bins_s"]),
        max_duration_s=used["synthesis"]["max_duration_s"],
        tolerance_s=used["evaluation"]["boundary_tolerance_s"],
        **used["evaluation"]["interior"],
        frame_s=used["speech"]["frame_s"],
    )
    return pd.DataFrame(
        scores.record_scores(scores.phrases(actual, rules), scores.phrases(synthesised, rules), rules)
    )


def write_bvh(motion: pd.DataFrame, path: str | Path) -> None:
    """Write a motion table as BVH, for animation programs: metres, y up.

    Examples
    --------
    >>> performance = api.synthesize("speech.wav", api.load_model())
    >>> api.write_bvh(performance.motion, "speech.bvh")
    """
    bvh.write(motion, path)


def _keywords_in(words: pd.DataFrame, model: ActorModel, duration_s: float) -> pd.DataFrame:
    """Return the words that are keywords of a model, whatever their case, as the model spells them."""
    method: Any = model.trained.method
    known = method.controls(model.trained.model).keywords if hasattr(method, "controls") else ()
    if not known:
        raise UserError(f"this model of '{model.system.name}' has no keywords; give a gesture controller some first")
    late = words[words["end_s"] > duration_s + 0.5]
    if len(late):
        word, end_s = late.iloc[0][["word", "end_s"]]
        raise UserError(
            f"the word '{word}' ends at {end_s:.3f} s, but the sound at {duration_s:.3f} s; give the words of the "
            "sound"
        )
    spelled = {word.casefold(): word for word in known}
    found = words.assign(word=words["word"].str.casefold().map(spelled)).dropna(subset="word")
    if found.empty:
        near = difflib.get_close_matches(next(iter(spelled)), words["word"].str.casefold().unique().tolist(), n=1)
        hint = f"; did you mean '{near[0]}'?" if near else ""
        raise UserError(f"none of the keywords {', '.join(known)} is among the words{hint}")
    return found


def _check_body(body: pd.DataFrame, duration_s: float, fps: float) -> None:
    """Raise UserError unless the motion of a body has the model's frame rate and the length of the sound."""
    body_fps = skeleton.frame_rate(body)
    # A workflow's motion may be a frame shorter: there, a frame that the sound does not fill is left out.
    if body_fps != fps or abs(len(body) / fps - duration_s) >= 1 / fps:
        raise UserError(
            f"the motion of the body has {len(body)} frames at {body_fps:g} fps; the sound of "
            f"{duration_s:.3f} s needs {round(duration_s * fps)} at {fps:g} fps"
        )
