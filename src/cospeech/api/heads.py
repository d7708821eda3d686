"""The functions on systems that move the head alone, which are part of ``cospeech.api``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.api.trained import check_tables, system_of_model
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats import audio
from cospeech.formats.sound import RATE_HZ
from cospeech.speech import melody, pitch
from cospeech.synthesis.declaration import System
from cospeech.synthesis.interface import Speech
from cospeech.synthesis.session import Trained, method_of, naming, perform
from cospeech.workflow import model_folder


class HeadModel(NamedTuple):
    """A system that moves the head alone, trained on an actor's records.

    Attributes
    ----------
    card : what the model is and which settings it uses (see docs/models.md).
    system : the declaration of its system.
    trained : the method of the system and its trained model.
    """

    card: Mapping[str, Any]
    system: System
    trained: Trained


class HeadPerformance(NamedTuple):
    """How a model moves a head to speech.

    Attributes
    ----------
    head : angles of the head (schema ``head``).
    decoding : one row that describes how they were made (schema ``decoding``).
    sound : (n,) the speech at 16 kHz, full scale 1.
    """

    head: pd.DataFrame
    decoding: pd.DataFrame
    sound: Floats


def load_head_model(folder: str | Path) -> HeadModel:
    """Load a model of a system that moves the head alone, trained by ``cospeech run models``.

    Parameters
    ----------
    folder : folder of the model.

    Raises
    ------
    UserError : if the folder contains no such model, or it is incomplete, damaged, or of another version.

    Examples
    --------
    >>> model = api.load_head_model("results/demo/models/head/main/ada")  # doctest: +SKIP
    """
    place = Path(folder)
    system = system_of_model(place)
    if system.makes != "head":
        raise UserError(f"{place}: a model of '{system.name}', which makes {system.makes}; see api.load_model")
    read = model_folder.read(place)
    check_tables(place, system, read)
    with naming(system):
        method = method_of(system)
        return HeadModel(read.card, system, Trained(method, method.from_tables(read.tables)))


def synthesize_head(
    sound: str | Path | Floats,
    model: HeadModel,
    *,
    record: str | None = None,
    seed: int | None = None,
    channel: int | None = None,
) -> HeadPerformance:
    """Synthesize the movements of a head for speech.

    Parameters
    ----------
    sound, record, seed, channel : as for ``synthesize``.
    model : the model of an actor.

    Returns
    -------
    Angles of the head that last as long as the sound, to the frame.

    Raises
    ------
    UserError : if the sound cannot be read or is not speech.

    Examples
    --------
    >>> model = api.load_head_model("results/demo/models/head/main/ada")  # doctest: +SKIP
    >>> api.synthesize_head("speech.wav", model).head[["x_deg", "y_deg", "z_deg"]].std()  # doctest: +SKIP
    """
    samples = audio.samples(sound, channel)
    name = record or ("speech" if isinstance(sound, np.ndarray) else Path(sound).stem)
    card, fps = model.card, float(model.card["motion_fps"])
    drawn = card["seed"] if seed is None else seed
    heard = melody.table(name, pitch.track(samples, RATE_HZ).f0_hz, melody.intensity(samples, RATE_HZ), drawn)
    speech = Speech(
        name,
        melody.STEP_S,
        len(heard),
        melody=heard,
        driving_record=name,
        motion_fps=fps,
        n_motion_frames=max(1, round(len(samples) / RATE_HZ * fps)),
    )
    made = perform(model.system, model.trained, speech, drawn)
    assert made.head is not None  # as it declares
    return HeadPerformance(made.head, made.decoding, samples)
