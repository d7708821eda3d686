"""The few functions that a notebook needs: records, prosody, training, synthesis, scores and BVH.

They do what the workflow does, on tables in memory.

Examples
--------
From speech to motion with the small model that comes with the package:

>>> from cospeech import api
>>> performance = api.synthesize("speech.wav", api.load_model())
>>> api.write_bvh(performance.motion, "speech.bvh")
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import soundfile

from cospeech import __version__
from cospeech.corpus import intake
from cospeech.corpus.retarget import MotionConventions
from cospeech.data import segments, tables, vocabulary
from cospeech.errors import UserError
from cospeech.evaluation import scores
from cospeech.formats import audio, bvh
from cospeech.formats.sound import RATE_HZ, Sound
from cospeech.motion import assembly, skeleton, unit_selection
from cospeech.segmentation import gesture, labelled_hmm
from cospeech.segmentation import prosody as clustering
from cospeech.segmentation.labelled_hmm import LabelledHMM
from cospeech.speech import prosody as measuring
from cospeech.synthesis.declaration import System
from cospeech.synthesis.interface import Speech
from cospeech.synthesis.registry import installed
from cospeech.synthesis.session import Session, Trained, method_of, naming, perform
from cospeech.synthesis.training import Actor, fold
from cospeech.workflow import config, model_folder, sweep
from cospeech.workflow import records as record_list

BUNDLED = Path(__file__).parent / "bundled_model"
"""The model of a virtual actor that comes with the package."""


class Record(NamedTuple):
    """A recording of an actor who talks: motion, prosody, and notes on what was done to the files."""

    name: str
    motion: pd.DataFrame
    prosody: pd.DataFrame
    notes: str


class ActorModel(NamedTuple):
    """A system trained on an actor's records, with all that new speech needs.

    Attributes
    ----------
    card : what the model is and rests on (docs/models.md).
    system : the declaration of its system. trained : its method and model.
    prosody_model : finds the prosody clusters of speech.
    gestures, motions : the motion library: gesture segments, and the motion table of each training record.
    """

    card: Mapping[str, Any]
    system: System
    trained: Trained
    prosody_model: LabelledHMM
    gestures: pd.DataFrame
    motions: Mapping[str, pd.DataFrame]


class Performance(NamedTuple):
    """What a model makes of speech.

    Attributes
    ----------
    phrases : gesture phrases (schema ``segments``). motion : motion table, as long as the sound to the frame.
    decoding : one row on how the phrases were found. sound : (n,) the speech at 16 kHz, full scale 1.
    """

    phrases: pd.DataFrame
    motion: pd.DataFrame
    decoding: pd.DataFrame
    sound: np.ndarray


def load_record(
    name: str,
    motion: str | Path,
    audio: str | Path,
    conventions: Mapping[str, Any] | None = None,
    settings: Mapping[str, Any] | None = None,
) -> Record:
    """Load a record from a motion file and its wav file, cut to their common length.

    Parameters
    ----------
    name : name of the record.
    motion : BVH, SMPL-X npz, or a motion table (parquet, csv).
    conventions : how to read the motion, as ``corpus.motion`` in the configuration: up, unit, joints, zero. By
        default the skeleton of cospeech in metres.
    settings : a configuration as ``settings()`` returns it.

    Raises
    ------
    UserError : where a file cannot be read, or the two do not fit.

    Examples
    --------
    >>> record = load_record("talk_1", "talk_1.bvh", "talk_1.wav")
    >>> record.motion["left_forearm_x_deg"].size, round(len(record.prosody) * 0.025)
    (240, 12)
    """
    used = settings or default_settings()
    given = dict.fromkeys(record_list.RECORD_FIELDS) | {"record": name, "actor": name, "audio": str(audio)}
    how = MotionConventions(**(conventions or used["corpus"]["motion"]))
    taken = intake.read_record(
        given | {"motion": str(motion)},
        str(motion),
        0.0,
        how,
        used["phrases"]["gesture"]["labels"],
        used["speech"]["frame_s"],
        used["corpus"]["length_tolerance_s"],
    )
    voice = taken.voice if isinstance(taken.voice, np.ndarray) else taken.voice.to_numpy()
    return Record(name, taken.body, prosody(voice, used, name), str(taken.row["note"].iloc[0] or ""))


def default_settings() -> dict[str, Any]:
    """Return the settings of the demo, which every configuration is laid over.

    Examples
    --------
    >>> default_settings()["speech"]["frame_s"]
    0.025
    """
    return config.defaults()


def prosody(
    sound: str | Path | np.ndarray, settings: Mapping[str, Any] | None = None, record: str = "speech"
) -> pd.DataFrame:
    """Return the prosody features of speech (Özkul 2012, 4.2; schema ``prosody``).

    Parameters
    ----------
    sound : a sound file, or (n,) samples at 16 kHz, full scale 1.
    settings : a configuration as ``default_settings`` returns it.

    Examples
    --------
    >>> table = prosody("speech.wav")
    >>> abs(table["intensity"].mean()) < 1e-9
    True
    """
    samples = sound if isinstance(sound, np.ndarray) else _as_recorded(audio.read(sound))
    how = dict((settings or default_settings())["speech"])
    voiced_gain = how.pop("voiced_gain")
    frames = measuring.measure(samples, RATE_HZ, **how)
    return measuring.features(frames, measuring.statistics(record, frames, voiced_gain), how["frame_s"])


def train(
    records: Sequence[Record],
    system: str | None = None,
    annotations: pd.DataFrame | None = None,
    settings: Mapping[str, Any] | None = None,
    actor: str = "actor",
) -> ActorModel:
    """Train a system on the records of one actor.

    Parameters
    ----------
    records : records of the actor, two or more.
    system : name of an installed system; by default the one that the videos of the demo show.
    annotations : labelled examples of gesture phrases (schema ``annotations``); by default they are read off the
        joint angles (``first_examples: rules``).
    settings : a configuration as ``default_settings`` returns it.

    Raises
    ------
    UserError : where no such system is installed, or the records do not suffice.

    Examples
    --------
    >>> records = [load_record(name, f"{name}.bvh", f"{name}.wav") for name in ("talk_1", "talk_2")]
    >>> model = train(records)
    >>> model.card["system"], model.card["variant"]
    ('hsmm_weighted', 'clusters~8,states~3')
    """
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
    tables = {record.name: record.prosody for record in records}
    clusters = clustering.train(list(tables.values()), *setting, used["phrases"]["prosody"], used["seed"])
    clustered = clustering.phrases(clusters.model, tables, frame_s)
    known = Actor(actor, names, frame_s, how["labels"], vocabulary.prosody_labels(setting.clusters))
    training, _ = fold(known, None, gestures, clustered, tables, motions)
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
    return ActorModel(card, declared, trained, clusters.model, gestures, motions)


def load_model(folder: str | Path | None = None) -> ActorModel:
    """Load a model that ``cospeech run models`` made; without a folder, the bundled one of a virtual actor.

    Raises
    ------
    UserError : where the folder holds no model, or it is incomplete, damaged, or of another version.

    Examples
    --------
    >>> load_model().card["corpus"]
    'virtual'
    """
    read = model_folder.read(Path(folder or BUNDLED))
    system = installed(read.card["system"])
    missing = [name for name in (*system.tables, "gestures", "prosody_model") if name not in read.tables]
    if missing:
        raise UserError(f"{folder}: a model of '{system.name}' has a table '{missing[0]}'; build the model again")
    with naming(system):
        method = method_of(system)
        trained = Trained(method, method.from_tables({name: read.tables[name] for name in system.tables}))
    motions = {
        name.removeprefix("motion~"): table for name, table in read.tables.items() if name.startswith("motion~")
    }
    prosody_model = labelled_hmm.from_table(read.tables["prosody_model"])
    return ActorModel(read.card, system, trained, prosody_model, read.tables["gestures"], motions)


def synthesize(
    sound: str | Path | Sound,
    model: ActorModel,
    *,
    record: str | None = None,
    seed: int | None = None,
    channel: int | None = None,
    body: pd.DataFrame | None = None,
) -> Performance:
    """Return gestures for speech that is in no corpus.

    Parameters
    ----------
    sound : a file that PyAV decodes, or a sound that has been read.
    record : name of the result; by default that of the file. Together with the seed it decides what is drawn.
    seed : seed of random draws; by default that of the run that made the model.
    channel : the channel to listen to, counted from 1; by default all channels are mixed.
    body : motion table for the hips, spine, head and legs, as long as the sound; by default they stand still.

    Raises
    ------
    UserError : where the sound cannot be read or is no speech, or ``body`` is of another length.

    Examples
    --------
    >>> performance = synthesize("speech.wav", load_model())
    >>> len(performance.motion), len(performance.sound) / 16000
    (200, 10.0)
    """
    read = sound if isinstance(sound, Sound) else audio.read(sound, channel)
    name = record or ("speech" if isinstance(sound, Sound) else Path(sound).stem)
    samples = _as_recorded(read)
    card, fps = model.card, float(model.card["motion_fps"])
    table = prosody(samples, card, name)
    frame_s = card["speech"]["frame_s"]
    heard = labelled_hmm.phrases(model.prosody_model, name, table, 1.0 / frame_s)
    n_frames = max(1, round(len(samples) / RATE_HZ * fps))
    if body is not None and (len(body) != n_frames or skeleton.frame_rate(body) != fps):
        raise UserError(
            f"{name}: the body's motion has {len(body)} frames at {skeleton.frame_rate(body):g} fps; the sound needs "
            f"{n_frames} at {fps:g} fps"
        )
    speech = Speech(
        name,
        frame_s,
        len(table),
        labels=segments.to_labels(heard),
        prosody=table,
        driving_record=name,
        motion_fps=fps,
        n_motion_frames=n_frames,
    )
    made = perform(model.system, model.trained, speech, card["seed"] if seed is None else seed)
    if made.motion is not None:
        return Performance(tables.empty("segments"), made.motion, made.decoding, samples)
    assert made.phrases is not None  # a system makes one or the other
    pool = unit_selection.templates(model.gestures, model.motions)
    units = unit_selection.select(made.phrases, pool, n_frames, fps, card["continuity_weight"])
    own = skeleton.standing(n_frames, fps) if body is None else body
    motion = assembly.motion(units, pool, model.motions, own, **card["smoothing"])
    return Performance(made.phrases, motion, made.decoding, samples)


def score(actual: pd.DataFrame, synthesised: pd.DataFrame, settings: Mapping[str, Any] | None = None) -> pd.DataFrame:
    """Return the scores of synthesised phrases against the actual ones of the same record.

    Parameters
    ----------
    actual, synthesised : segment tables.
    settings : a configuration as ``default_settings`` returns it.

    Returns
    -------
    Rows of measure, part, gesture, bin_s and value (schema ``record_scores``).

    Examples
    --------
    >>> phrases = synthesize("speech.wav", load_model()).phrases
    >>> table = score(phrases, phrases)
    >>> float(table.loc[table["measure"] == "frames_right", "value"].iloc[0])
    1.0
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
    """Write a motion table as BVH.

    Examples
    --------
    >>> write_bvh(synthesize("speech.wav", load_model()).motion, "speech.bvh")
    >>> Path("speech.bvh").read_text().split()[0]
    'HIERARCHY'
    """
    bvh.write(motion, path)


def _as_recorded(read: Sound) -> np.ndarray:
    """Return the samples as a record of the workflow has them: rounded to 16 bits."""
    encoded = io.BytesIO()
    soundfile.write(encoded, read.samples, RATE_HZ, subtype="PCM_16", format="WAV")
    encoded.seek(0)
    samples: np.ndarray = soundfile.read(encoded)[0]
    return samples
