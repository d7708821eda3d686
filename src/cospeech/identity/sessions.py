"""The four sessions of Sargin 2006, 2.4: two partitions of the clients' clips, each half trained on in turn.

The document calls the training sets of the two partitions disjoint, which would make the partitions the same; they
are read as two different ones. The first takes the first half of a speaker's repetitions, the second every other one.
Every clip of an impostor, a registered speaker who says the name of another one, is tested in each session.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Flags, Integers
from cospeech.errors import UserError


class Session(NamedTuple):
    """One session.

    Attributes
    ----------
    name : ``1`` to ``4``, or ``all``.
    speakers : the registered speakers, in the order of their models.
    train, owner : (C,) clips that are trained on, by index, and the index of the speaker of each.
    test : (K,) clips that are tested.
    """

    name: str
    speakers: list[str]
    train: Integers
    owner: Integers
    test: Integers


NAMES = ("1", "2", "3", "4")


def registered(clips: pd.DataFrame) -> list[str]:
    """Return the speakers who can be registered: those with two repetitions of their own name or more."""
    own = clips[clips["own_name"]].groupby("speaker", sort=True).size()
    return [str(name) for name in own[own > 1].index]


def sessions(clips: pd.DataFrame) -> list[Session]:
    """Return the four sessions.

    Parameters
    ----------
    clips : the table ``clips``.

    Raises
    ------
    UserError : if fewer than two speakers can be registered.
    """
    speakers, client, owner = _clients(clips)
    rank = clips["repetition"].where(client).groupby(clips["speaker"]).rank(method="first").fillna(0.0).to_numpy()
    count = np.bincount(owner[client], minlength=len(speakers))
    half = (count + 1) // 2
    first = rank <= np.where(client, half[owner], 0)
    odd = rank % 2 == 1
    others = np.flatnonzero(~clips["own_name"].to_numpy(dtype=bool))
    found = []
    for name, part in zip(NAMES, (first, ~first, odd, ~odd), strict=True):
        train, tested = np.flatnonzero(client & part), np.flatnonzero(client & ~part)
        found.append(Session(name, speakers, train, np.asarray(owner[train]), np.concatenate([tested, others])))
    return found


def of_all(clips: pd.DataFrame) -> Session:
    """Return a session that trains on all clips of clients, and tests those of impostors."""
    speakers, client, owner = _clients(clips)
    train = np.flatnonzero(client)
    others = np.flatnonzero(~clips["own_name"].to_numpy(dtype=bool))
    return Session("all", speakers, train, np.asarray(owner[train]), others)


def _clients(clips: pd.DataFrame) -> tuple[list[str], Flags, Integers]:
    """Return the registered speakers, whether each clip is theirs as clients, and the index of its speaker."""
    speakers = registered(clips)
    if len(speakers) < 2:
        raise UserError(
            f"{len(speakers)} speakers have two repetitions of their own name or more; identification needs two such "
            "speakers, add clips to the sheet"
        )
    place = {name: index for index, name in enumerate(speakers)}
    client = clips["own_name"].to_numpy(dtype=bool) & clips["speaker"].isin(speakers).to_numpy()
    owner = np.asarray(clips["speaker"].map(place).fillna(-1), dtype=np.int64)
    return speakers, client, owner


def named(clips: pd.DataFrame, name: str) -> Session:
    """Return the session of this name; see ``sessions``."""
    return sessions(clips)[NAMES.index(name)]
