"""A fold of four coupled records with everything that a system can need, and the systems that are installed."""

from importlib.metadata import entry_points

import numpy as np
import pandas as pd
from coupled_actor import FRAME_S, PATTERNS, CoupledActor, corpus

from cospeech.data import segments
from cospeech.data.vocabulary import GESTURES
from cospeech.motion import skeleton
from cospeech.synthesis.hsmm.tables import to_tables
from cospeech.synthesis.registry import registered
from cospeech.synthesis.session import Driving, Session
from cospeech.synthesis.speech import Wrong
from cospeech.synthesis.training import Actor, Truth, fold

SEED = 2012
RECORDS = ("r0", "r1", "r2", "r3")
HELD_OUT = "r1"
DURATION_S = 40.0
N_FRAMES = round(DURATION_S / FRAME_S)
MOTION_FPS = 20.0
COUPLING = 0.8

SHARED = {
    "max_duration_s": 10.0,
    "durations": {"smoothing": "none", "amount": 1.0},
    "floor": 1e-6,
    "censoring": "none",
    "emission_weights": [0.25],
    "shift_s": 5.0,
}
"""The section ``synthesis`` of a configuration."""

ACTOR = Actor("ada", RECORDS, FRAME_S, GESTURES, tuple(PATTERNS))


def names_of(package):
    """The names of the systems, controls and ceilings that an installed package declares."""
    found = [entry.load() for entry in entry_points(group="cospeech.systems") if entry.dist.name == package]
    return [system.name for declared in found for system in declared]


def all_systems(*packages):
    """The systems of cospeech and of other installed packages, with their matched controls.

    Systems that learn from phases or subunits of motion, or from heads, are not among them; they have tests of their
    own.
    """
    names = [name for package in ("cospeech", *packages) for name in names_of(package)]
    systems = registered({name: {} for name in names}, virtual=True).systems
    return {
        name: system for name, system in systems.items() if not {"phases", "subunits", "head"} & set(system.needs)
    }


def prosody_tables(records, n_frames=N_FRAMES, seed=1):
    """Random prosody features of each record."""
    tables = {}
    for place, record in enumerate(records):
        rng = np.random.default_rng([seed, place])
        names = ("intensity", "pitch_lag", "pitch_gain", "d_intensity", "d_pitch_lag", "d_pitch_gain")
        table = pd.DataFrame({name: rng.uniform(-1, 1, n_frames) for name in names})
        table.insert(0, "frame", np.arange(n_frames))
        table.insert(1, "time_s", segments.frame_times(n_frames, 1 / FRAME_S))
        tables[record] = table
    return tables


def truth_of(actor, gestures, prosody):
    """What a studio planted: the process of the actor, who is called ada, and of somebody else."""
    return Truth(
        {
            name: pd.concat([table.assign(actor="somebody"), table.assign(actor="ada")], ignore_index=True)
            for name, table in to_tables(actor.process(COUPLING), FRAME_S).items()
        },
        gestures,
        prosody,
    )


class OneFold:
    """A fold of records of 40 s, and the sessions and speech of its systems."""

    def __init__(self):
        self.gestures, self.prosody = corpus(3, len(RECORDS), DURATION_S, COUPLING)
        self.prosody_tables = prosody_tables(RECORDS)
        self.motions = dict.fromkeys(RECORDS, skeleton.standing(round(DURATION_S * MOTION_FPS), MOTION_FPS))
        self.truth = truth_of(CoupledActor(3), self.gestures, self.prosody)
        self.training, self.streams = fold(
            ACTOR, HELD_OUT, self.gestures, self.prosody, self.prosody_tables, self.motions, self.truth
        )

    def session(self, **changed):
        """A session in which nothing is trained yet; ``changed`` are settings that all systems share."""
        return Session(self.training, SHARED | changed, {})

    def driving(self, seed=SEED):
        n_frames = round(DURATION_S * MOTION_FPS)
        return Driving(self.streams, HELD_OUT, FRAME_S, seed, Wrong(SHARED["shift_s"]), MOTION_FPS, n_frames)

    def everything(self, systems, seed=SEED, **changed):
        """What every system makes in its first draw, by name."""
        session, driving = self.session(**changed), self.driving(seed)
        return {name: session.synthesise(system, driving)[0] for name, system in systems.items()}
