"""Read files with the angles of a head that another program measured, such as a tracker of faces.

Nothing in such a file says in which order its rotations are composed, in which unit its angles are, or where its axes
point. They have to be declared in the configuration (``corpus.head``), and are never guessed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from cospeech.corpus import user_tables
from cospeech.data import tables
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.geometry import axes, rotation
from cospeech.motion import head

DECLARED = "corpus.head"
"""The section of the configuration that declares the conventions of such files."""

OURS = ("head", "head_pose")
"""The schemas of our own tables of head angles."""

SMALLEST_DEG = 2 * np.pi
"""If no angle of a file in degrees exceeds this value, its angles must be in radians."""


@dataclass(frozen=True)
class HeadConventions:
    """What a file of head angles does not say.

    Attributes
    ----------
    order : axes about which the head is rotated, outermost first: ``XYZ`` for axes that turn with the head,
        ``xyz`` for axes that stay; None: not declared.
    unit : ``deg`` or ``rad``; None: not declared.
    up, facing : the axis of the file that points up, and the one in which the person faces: x, y, z, -x, -y or -z.
    columns : the columns with the time and with the angles about x, y and z.
    """

    order: str | None
    unit: str | None
    up: str
    facing: str
    columns: Mapping[str, str]


def read(path: str | Path, record: str, conventions: HeadConventions) -> pd.DataFrame:
    """Return the angles of the head of a record (schema ``head``); frames that the file leaves empty have none.

    Parameters
    ----------
    path : a Parquet or CSV file, with one row per frame. A table of the schemas ``head`` or ``head_pose`` that
        cospeech wrote needs no declaration.
    record : name of the record for error messages.
    conventions : what is declared about such files.

    Raises
    ------
    UserError : if the order or the unit is not declared, or contradicts the file; if a column is missing; if frames
        are not uniform in time; or if no frame has angles.
    """
    schema = _schema(path)
    if schema in OURS:
        known = tables.read(path, schema)
        return _checked(known[head.COLUMNS].to_numpy(dtype=float), head.frame_rate(known), path)
    undeclared = [key for key in ("order", "unit") if getattr(conventions, key) is None]
    if undeclared:
        raise UserError(
            f"record '{record}': {path}: its angles come without their {' and '.join(undeclared)}; declare "
            f"{' and '.join(f'{DECLARED}.{key}' for key in undeclared)}, such as order: XYZ and unit: deg"
        )
    found = user_tables.load(path, "head")
    missing = [name for name in conventions.columns.values() if name not in found.columns]
    if missing:
        raise UserError(
            f"{path}: column '{missing[0]}' is missing; name its columns in {DECLARED}.columns (it has "
            f"{', '.join(map(str, found.columns[:12]))})"
        )
    timed = pd.DataFrame({"frame": np.arange(len(found)), "time_s": found[conventions.columns["time"]]})
    period_s = user_tables.frame_period(timed, path)
    given = np.column_stack([pd.to_numeric(found[conventions.columns[axis]], errors="coerce") for axis in "xyz"])
    return _checked(_in_our_axes(_degrees(given.astype(float), conventions, path), conventions), 1 / period_s, path)


def _schema(path: str | Path) -> str | None:
    """Return the schema of a table that cospeech wrote, or None for any other file."""
    if Path(path).suffix.lower() != ".parquet" or not Path(path).is_file():
        return None
    try:
        return tables.read_metadata(path).get("schema")
    except UserError:
        return None  # damaged, which its reader reports


def _degrees(given: Floats, conventions: HeadConventions, path: str | Path) -> Floats:
    if np.isnan(given).all():
        raise UserError(f"{path}: no frame has angles; check {DECLARED}.columns")
    largest = float(np.nanmax(np.abs(given)))
    if conventions.unit == "rad":
        if largest > 2 * np.pi:
            raise UserError(f"{path}: an angle of {largest:.4g} is not in radians; set {DECLARED}.unit to deg")
        return np.degrees(given)
    if largest < SMALLEST_DEG and np.nanstd(given) < 0.5:
        raise UserError(
            f"{path}: no angle exceeds {largest:.3g}, so they seem to be in radians; set {DECLARED}.unit to rad, or "
            "leave out a head that does not move"
        )
    return given


def _in_our_axes(angles_deg: Floats, conventions: HeadConventions) -> Floats:
    """Return angles (T, 3) about x, y and z of a file as angles of our order about our axes."""
    order = str(conventions.order)
    composed = order.upper() if order.isupper() else order.upper()[::-1]
    places = ["XYZ".index(axis) for axis in composed]
    turned = rotation.from_euler(composed, angles_deg[:, places])
    ours = axes.world_rotation(conventions.up, conventions.facing, DECLARED)
    return rotation.to_euler(head.EULER_ORDER, ours @ turned @ ours.T)


def _checked(angles_deg: Floats, fps: float, path: str | Path) -> pd.DataFrame:
    """Return a table of angles; a frame without one of its angles has none."""
    known = np.isfinite(angles_deg.sum(axis=1))
    if not known.any():
        raise UserError(f"{path}: no frame has angles; check the file, or leave this record out")
    return head.table(np.where(known[:, None], angles_deg, np.nan), fps)
