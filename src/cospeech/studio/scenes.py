"""The scene of a record: everything that is planted in it, in any world.

In the world ``phrases``, this is the script alone. The other worlds add syllables, and, depending on the world,
arousal, the subunits that follow syllables, or pitch movements and the head gestures that are joined with them.
``worlds`` describes what depends on what.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from cospeech.data.arrays import Flags, Floats
from cospeech.data.rng import random_source
from cospeech.data.vocabulary import GESTURES
from cospeech.studio import arousal, cast, head_gestures, movements, script, subunits, syllables, worlds
from cospeech.studio.syllables import Delivery
from cospeech.studio.worlds import Couplings

TABLES = {
    "gesture_phrases": ("gestures", "segments"),
    "prosody_phrases": ("prosody", "segments"),
    "syllables": ("syllables", "planted_syllables"),
    "arousal_speech": ("spoken", "segments"),
    "arousal_hands": ("shown", "segments"),
    "subunits": ("subunits", "planted_subunits"),
    "melody_patterns": ("movements", "segments"),
    "head_patterns": ("heads", "segments"),
    "head_joints": ("joints", "head_joints"),
}
"""The tables of what is planted in records: the attribute of a scene, and the schema, by name."""

COUNTED_S = 3600.0
"""Duration of the sample in which gesture phrases are counted that no semi-Markov process generates."""

SMOOTHING_S, ANY_DURATION = 0.1, 0.01
"""Standard deviation of the Gaussian window that counted durations are smoothed with, and the share of a uniform
distribution that is added, as no sample contains all durations that are possible."""


@dataclass(frozen=True)
class Player:
    """An actor of the studio in one world: the gestures, the arousal, the subunits, and the habits of voice and head.

    Attributes
    ----------
    member : the semi-Markov process of gesture phrases.
    arousal_model : the arousal, None if the world contains none.
    streams : the streams of subunits by section, None if the world contains none.
    following : (K, K) probability of the next pitch movement, None unless all speech consists of them.
    head : the head gestures, used where they are joined with pitch movements.
    """

    member: cast.Member
    arousal_model: arousal.ArousalModel | None
    streams: dict[str, subunits.Stream] | None
    following: Floats | None
    head: head_gestures.Habits


@dataclass(frozen=True)
class Scene:
    """What is planted in one record.

    Attributes
    ----------
    gestures, prosody : gesture phrases and intonation phrases, segment tables.
    syllables : the syllables of its speech, and those of other speech that the body follows instead (schema
        ``planted_syllables``); None in the world ``phrases``.
    spoken, shown : arousal in the speech and in the hands, segment tables; None if the world contains none.
    subunits : schema ``planted_subunits``; None if the world contains none.
    movements, heads : pitch movements and head gestures, segment tables; None if they are not joined.
    joints : schema ``head_joints``; None if they are not joined.
    """

    gestures: pd.DataFrame
    prosody: pd.DataFrame
    syllables: pd.DataFrame | None = None
    spoken: pd.DataFrame | None = None
    shown: pd.DataFrame | None = None
    subunits: pd.DataFrame | None = None
    movements: pd.DataFrame | None = None
    heads: pd.DataFrame | None = None
    joints: pd.DataFrame | None = None

    def delivery(self) -> Delivery | None:
        """Return how the record is spoken, None in the world ``phrases``."""
        if self.syllables is None:
            return None
        own = self.syllables.query("source == 'own'").reset_index(drop=True)
        if self.spoken is None and self.subunits is None:  # all speech consists of pitch movements
            return Delivery(own, None, flatness=1.0, accents=movements.ACCENTS)
        return Delivery(own, self.spoken)


def player(actor: str, world: str, seed: int, frame_s: float, max_duration_s: float) -> Player:
    """Return ``actor`` in a world, sampled from the seed and the actor's name; see ``cast.member``."""
    couplings = worlds.couplings(world, 1.0, {})
    return Player(
        cast.member(actor, seed, frame_s, max_duration_s),
        None if couplings.vigour is None else arousal.model(actor, seed, frame_s),
        None if couplings.syllables is None else subunits.streams(actor, world, seed),
        None if couplings.patterns is None else movements.habits(actor, seed),
        head_gestures.habits(actor, seed),
    )


def write(own: Player, record: str, duration_s: float, couplings: Couplings, frame_s: float, seed: int) -> Scene:
    """Return the scene of one record.

    Parameters
    ----------
    own : the actor in the world.
    duration_s : duration of the record.
    couplings : the couplings of the world.
    frame_s : spacing of prosody frames.
    """
    body = _body(own, record, duration_s, couplings, frame_s, seed)
    if couplings.patterns is None:
        return body
    spoken = movements.of_phrases(body.prosody)
    elsewhere = f"{record} of another head"
    unheard = movements.of_phrases(_speech(own, elsewhere, duration_s, 0.0, frame_s, seed)[1])
    heads, joints = head_gestures.write(own.head, spoken, unheard, couplings.patterns, frame_s, seed)
    return replace(body, movements=spoken, heads=heads, joints=joints)


def _body(own: Player, record: str, duration_s: float, couplings: Couplings, frame_s: float, seed: int) -> Scene:
    """Return the scene of one record without the gestures of the head."""
    gestures, prosody, spoken_syllables = _speech(own, record, duration_s, couplings.phrases or 0.0, frame_s, seed)
    if spoken_syllables is not None:
        table = _planted(record, "own", spoken_syllables)
        return Scene(gestures, prosody, table.assign(followed=False))
    if own.arousal_model is None and own.streams is None:
        return Scene(gestures, prosody)
    n_frames = int(prosody["end_frame"].iloc[-1])
    spoken, shown = None, None
    if own.arousal_model is not None:
        spoken, shown = arousal.write(own.arousal_model, record, n_frames, couplings.vigour or 0.0, frame_s, seed)
    spoken_syllables = syllables.sample(prosody, spoken, random_source(seed, "syllables", record))
    table = _planted(record, "own", spoken_syllables)
    if own.streams is None:
        return Scene(gestures, prosody, table.assign(followed=False), spoken, shown)
    table = _followed(own, table, record, duration_s, couplings.syllables or 0.0, frame_s, seed)
    moved = subunits.write(own.streams, record, syllables.heard(table), duration_s, seed)
    arms = moved[moved["section"] == "arms"]
    if own.streams["arms"].kinds == GESTURES:
        gestures = subunits.phrases(record, arms, n_frames, frame_s)
    return Scene(gestures, prosody, table, spoken, shown, moved)


def _speech(
    own: Player, record: str, duration_s: float, coupling: float, frame_s: float, seed: int
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame | None]:
    """Return gesture phrases and intonation phrases, and the syllables of speech that consists of pitch movements."""
    gestures, prosody = script.write(own.member, record, duration_s, coupling, frame_s, seed)
    if own.following is None:
        return gestures, prosody, None
    spoken = syllables.sample(prosody, None, random_source(seed, "syllables", record))
    rng = random_source(seed, "movements of record", record)
    return gestures, movements.write(prosody, spoken, own.following, frame_s, rng), spoken


def truth(players: Mapping[str, Player], couplings: Mapping[str, Couplings]) -> dict[str, pd.DataFrame]:
    """Return what is planted of the actors besides their gestures, as tables by the name of their schema.

    Parameters
    ----------
    players : the actors, each in its world.
    couplings : the couplings of each actor.
    """
    tables: dict[str, pd.DataFrame] = {}
    states = [
        arousal.states_table([own.arousal_model], couplings[actor].vigour or 0.0)
        for actor, own in players.items()
        if own.arousal_model is not None
    ]
    if states:
        tables["arousal_states"] = pd.concat(states, ignore_index=True)
    heads = {actor: own.head for actor, own in players.items() if couplings[actor].patterns is not None}
    if heads:
        tables["head_habits"] = head_gestures.truth(heads)
    streams = {actor: own.streams for actor, own in players.items() if own.streams is not None}
    return tables | (subunits.tables(streams) if streams else {})


def tables(scenes: Sequence[Scene]) -> dict[str, pd.DataFrame]:
    """Return what is planted in records, one table for all of them by each name of ``TABLES`` that a record has."""
    parts = {
        name: [part for scene in scenes if (part := getattr(scene, attribute)) is not None]
        for name, (attribute, _) in TABLES.items()
    }
    return {name: pd.concat(part, ignore_index=True) for name, part in parts.items() if part}


def of_record(whole: Mapping[str, pd.DataFrame], record: str) -> Scene:
    """Return the scene of one record from tables of all records, the inverse of ``tables``.

    A table without a row of the record belongs to the worlds of other actors, and the scene has None instead.
    """
    rows = {name: table[table["record"] == record].reset_index(drop=True) for name, table in whole.items()}
    return Scene(**{TABLES[name][0]: table for name, table in rows.items() if len(table)})


def _planted(record: str, source: str, drawn: pd.DataFrame) -> pd.DataFrame:
    numbered = drawn.assign(record=record, source=source, syllable=np.arange(len(drawn)))
    return numbered[["record", "source", "syllable", *drawn.columns]]


def _followed(
    own: Player, table: pd.DataFrame, record: str, duration_s: float, coupling: float, frame_s: float, seed: int
) -> pd.DataFrame:
    """Return the syllables of a record and those of independent speech, and which of them the body follows."""
    elsewhere = f"{record} elsewhere"
    prosody = script.write(own.member, elsewhere, duration_s, 0.0, frame_s, seed)[1]
    spoken, n_frames = None, int(prosody["end_frame"].iloc[-1])
    if own.arousal_model is not None:
        spoken, _ = arousal.write(own.arousal_model, elsewhere, n_frames, 0.0, frame_s, seed)
    drawn = syllables.sample(prosody, spoken, random_source(seed, "syllables", elsewhere))
    spans = worlds.listening(duration_s, coupling, random_source(seed, "listens to syllables", record))
    other = _planted(record, "other", drawn)

    def listens(rows: pd.DataFrame) -> Flags:
        return worlds.listens(rows["peak_s"].to_numpy(), spans)

    parts = [table.assign(followed=listens(table)), other.assign(followed=~listens(other))]
    return pd.concat(parts, ignore_index=True)


def gesture_model(own: Player, max_duration_s: float, frame_s: float, seed: int) -> cast.Member:
    """Return the semi-Markov process of an actor's gesture phrases.

    Where subunits form the phrases, they are not such a process; it is then counted in a long sample.
    """
    if own.streams is None or own.streams["arms"].kinds != GESTURES:
        return own.member
    name = f"{own.member.actor} counted"
    scene = write(own, name, COUNTED_S, Couplings(None, None, 0.0), frame_s, seed)
    codes = np.array([GESTURES.index(label) for label in scene.gestures["label"]])
    frames = (scene.gestures["end_frame"] - scene.gestures["start_frame"]).to_numpy()
    bins = round(max_duration_s / frame_s)
    n = len(GESTURES)
    transitions, durations = np.zeros((n, n)), np.zeros((n, bins))
    np.add.at(transitions, (codes[:-1], codes[1:]), 1.0)
    np.add.at(durations, (codes[:-1], np.minimum(frames[:-1], bins) - 1), 1.0)
    initial = np.zeros(n)
    initial[GESTURES.index(subunits.FIRST["arms"])] = 1.0
    return cast.Member(
        actor=own.member.actor,
        initial=initial,
        transitions=_normalised(transitions),
        durations=_smoothed(_normalised(durations), SMOOTHING_S / frame_s),
        coupled=np.tile(own.member.marginal(), (n, 1)),
    )


def _normalised(counts: Floats) -> Floats:
    """Return the rows of counts as probabilities; a row without a count is uniform."""
    filled = np.where(counts.sum(axis=1, keepdims=True) > 0.0, counts, 1.0)
    return np.asarray(filled / filled.sum(axis=1, keepdims=True))


def _smoothed(durations: Floats, deviation: float) -> Floats:
    """Return duration probabilities (G, D), smoothed over their bins; no duration is impossible."""
    half = math.ceil(4.0 * deviation)
    window = np.exp(-0.5 * (np.arange(-half, half + 1) / max(deviation, 1e-9)) ** 2)
    smooth = _normalised(np.array([np.convolve(row, window)[half : half + len(row)] for row in durations]))
    return np.asarray((1.0 - ANY_DURATION) * smooth + ANY_DURATION / durations.shape[1])
