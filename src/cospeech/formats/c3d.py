"""C3D files (c3d.org), the exchange format of motion capture laboratories.

The library ezc3d writes the files. We read them ourselves, because a damaged file can crash that library or keep it
busy for minutes, and to get all names of more than 255 markers and the numbers of every processor. A marker is lost
where its residual is negative, a coordinate is NaN, or all three are exactly zero. The unit is the free text
POINT:UNITS; without it, the user has to state the unit, because the sizes cannot be known.

A file begins with a header of 512 bytes, which gives the place of the parameters, which give the place of the data.
The number of frames is stated in up to four places, because 16 bits no longer suffice; the one that agrees with the
size of the data is used.
"""

from __future__ import annotations

import math
import os
import struct
from pathlib import Path
from typing import NamedTuple

import ezc3d
import numpy as np
import numpy.typing as npt

from cospeech.data import frame_rates, tables, units
from cospeech.data.arrays import Floats
from cospeech.data.trajectories import Trajectories, without_zeros
from cospeech.data.units import METRES
from cospeech.errors import UserError
from cospeech.formats import foreign

SECTION, MAGIC = 512, 0x50
"""Bytes in a section; the second byte of every C3D file."""

INTEL, DEC, MIPS = 84, 85, 86
"""Processor types: little-endian numbers, floats of the VAX, and big-endian numbers."""

MAX_IN_HEADER = 65535
"""Number of the last frame in the header of a file whose last frame has this number or a larger one."""

MAX_FPS = 10000.0

Value = list[str] | Floats


class _Processor(NamedTuple):
    """How a file stores its numbers."""

    kind: int

    @property
    def order(self) -> str:
        """Byte order, in the notation of NumPy and ``struct``."""
        return ">" if self.kind == MIPS else "<"

    def floats(self, content: bytes | memoryview) -> npt.NDArray[np.float32]:
        """Return the 32-bit floats in ``content``."""
        if self.kind != DEC:
            return np.frombuffer(content, f"{self.order}f4")
        # A VAX stores the two halves of a float in the other order, with an exponent that is greater by 2.
        halves = np.frombuffer(content, "<u2").reshape(-1, 2)
        values = np.ascontiguousarray(halves[:, ::-1]).view("<u4").reshape(-1).view("<f4") / np.float32(4)
        return np.asarray(values, dtype=np.float32)


def write(trajectories: Trajectories, path: str | Path) -> None:
    """Write trajectories in millimetres, as is customary, with a residual of -1 in gaps."""
    names, places, fps = trajectories[:3]
    lost = np.any(np.isnan(places), axis=2).T
    points = np.ones((4, len(names), len(places)))
    points[:3] = np.where(lost, np.nan, places.transpose(2, 1, 0) / METRES["mm"])
    file = ezc3d.c3d()
    point = file["parameters"]["POINT"]
    point["RATE"]["value"] = [fps]
    point["UNITS"]["value"] = ["mm"]
    point["LABELS"]["value"] = list(names)
    file.add_parameter("POINT", "X_SCREEN", ["+X"])
    file.add_parameter("POINT", "Y_SCREEN", ["+Y"])
    file["data"]["points"] = points
    file["data"]["meta_points"]["residuals"] = np.where(lost, -1.0, 0.0)[None]
    with tables.replacing(path) as temporary:
        file.write(os.fspath(temporary))


def read(path: str | Path, unit: str | float | None = None) -> Trajectories:
    """Read the named markers of a C3D file; positions in metres, NaN where a marker is lost.

    Parameters
    ----------
    path : the file.
    unit : unit of the positions, as in ``units.METRES`` or in metres; None: as the file says.

    Raises
    ------
    UserError : if the file is missing, damaged or too large, or has no markers, no known unit or no frame rate.
    """
    content = foreign.read_bytes(path)
    if len(content) < SECTION or content[1] != MAGIC:
        raise UserError(f"{path}: is not a C3D file, or truncated; name a C3D file, or copy it again")
    start = SECTION * (max(content[0], 1) - 1)
    if len(content) < start + SECTION:
        raise UserError(f"{path}: is truncated before its parameters; copy or export it again")
    processor = _Processor(content[start + 3])
    if processor.kind not in (INTEL, DEC, MIPS):
        raise UserError(
            f"{path}: unknown processor type {processor.kind} in its parameters; convert it to an Intel C3D file"
        )
    parameters = _parameters(content, start + 4, processor, str(path))
    # Fields of the header: points, analog values per frame, first and last frame, ..., first section of the data.
    points, analog, first, last, _, data = struct.unpack_from(f"{processor.order}5H4xH", content, 2)
    n_markers = _count(parameters, "POINT:USED", points)
    factor, notes = _metres(parameters, unit, path)
    names = _names(parameters)[:n_markers]
    if n_markers == 0 or not any(names):
        raise UserError(
            f"{path}: has {n_markers} markers with {sum(map(bool, names))} names; export it with POINT:LABELS"
        )
    scale = _number(parameters, "POINT:SCALE", float(processor.floats(content[12:16])[0]))
    if scale == 0 or not math.isfinite(scale):
        raise UserError(f"{path}: has the scale {scale:g} (POINT:SCALE); export it again")
    begin = SECTION * (_count(parameters, "POINT:DATA_START", data) - 1)
    if begin < SECTION:
        raise UserError(f"{path}: does not say where its data begin (POINT:DATA_START); export it again")
    frame_bytes = (4 if scale < 0 else 2) * (4 * n_markers + analog)
    n_frames = _n_frames(parameters, (first, last), frame_bytes, len(content) - begin, str(path))
    rate = _number(parameters, "POINT:RATE", float(processor.floats(content[20:24])[0]))
    if not 1.0 <= rate <= MAX_FPS:
        raise UserError(f"{path}: a frame rate of {rate:g} Hz (POINT:RATE); set it and save the file again")
    fps, rounded = frame_rates.from_rate(rate)
    stored = memoryview(content)[begin : begin + n_frames * frame_bytes]
    values = processor.floats(stored) if scale < 0 else np.frombuffer(stored, f"{processor.order}i2")
    named = [index for index, name in enumerate(names) if name]
    held = values.reshape(n_frames, -1)[:, : 4 * n_markers].reshape(n_frames, n_markers, 4)[:, named]
    with np.errstate(invalid="ignore"):
        places = held[:, :, :3].astype(float) * (factor if scale < 0 else factor * scale)
        lost = (held[:, :, 3] < 0) | ~np.isfinite(places).all(axis=2)
    places[lost] = np.nan
    return Trajectories(tuple(names[index] for index in named), without_zeros(places), fps, (*notes, *rounded))


def _parameters(content: bytes, place: int, processor: _Processor, where: str) -> dict[str, Value]:
    """Return the parameters by ``GROUP:NAME``; texts as a list, numbers as an array."""
    malformed = UserError(f"{where}: its parameters are malformed or truncated; copy or export it again")
    groups: dict[int, str] = {}
    found: list[tuple[int, str, Value]] = []
    while place + 4 <= len(content):
        length, group = (
            abs(struct.unpack_from("b", content, place)[0]),
            struct.unpack_from("b", content, place + 1)[0],
        )
        following = place + 2 + length
        if length == 0 or group == 0:
            break
        if following + 2 > len(content):
            raise malformed
        name = content[place + 2 : following].decode("latin-1").strip().upper()
        offset = struct.unpack_from(f"{processor.order}H", content, following)[0]
        if group < 0:
            groups[-group] = name
        else:
            value = _value(content, following + 2, processor)
            if value is None:
                raise malformed
            found.append((group, name, value))
        if offset == 0:
            break
        if offset < 2:
            raise malformed
        place = following + offset
    return {f"{groups[group]}:{name}": value for group, name, value in found if group in groups}


def _value(content: bytes, place: int, processor: _Processor) -> Value | None:
    """Return the value of a parameter whose type stands at ``place``, or None if the file does not hold all of it."""
    if place + 2 > len(content):
        return None
    kind, n_dimensions = struct.unpack_from("bB", content, place)
    sizes = list(content[place + 2 : place + 2 + n_dimensions])
    begin = place + 2 + n_dimensions
    count = math.prod(sizes)
    stored = content[begin : begin + count * abs(kind)]
    if kind not in (-1, 1, 2, 4) or len(sizes) < n_dimensions or len(stored) < count * abs(kind):
        return None
    if kind == -1:
        width = sizes[0] if sizes else 1
        rows = [stored[at : at + width] for at in range(0, count, width)] if width else []
        return [foreign.normalised(_text(row)) for row in rows]
    if kind == 4:
        return processor.floats(stored).astype(float)
    return np.frombuffer(stored, f"{processor.order}u{kind}").astype(float)


def _text(content: bytes) -> str:
    try:
        return content.decode().strip(" \0")
    except UnicodeDecodeError:
        return content.decode("latin-1").strip(" \0")


def _number(parameters: dict[str, Value], name: str, default: float) -> float:
    """Return the first value of a parameter; integers are unsigned."""
    value = parameters.get(name)
    return float(value[0]) if isinstance(value, np.ndarray) and len(value) else default


def _count(parameters: dict[str, Value], name: str, default: int) -> int:
    value = _number(parameters, name, default)
    return int(value) if 0 <= value < 2**31 else 0


def _names(parameters: dict[str, Value]) -> list[str]:
    """Return the names of the markers: POINT:LABELS holds 255 of them, LABELS2 the next ones, and so on."""
    names: list[str] = []
    number = 1
    while isinstance(more := parameters.get(f"POINT:LABELS{number if number > 1 else ''}"), list):
        names, number = names + more, number + 1
    return names


def _metres(parameters: dict[str, Value], declared: str | float | None, path: str | Path) -> tuple[float, list[str]]:
    """Return the unit in metres, and a note if the declared unit replaces that of the file."""
    said = parameters.get("POINT:UNITS")
    unit = said[0] if isinstance(said, list) and said else ""
    if declared is not None:
        return units.metres_per_unit(declared), units.replaced(unit, declared)
    if not unit:
        raise UserError(f"{path}: does not say its unit (POINT:UNITS is empty); state it in corpus.markers.unit")
    metres = units.stated_metres(unit)
    if metres is None:
        raise UserError(
            f"{path}: unknown unit '{unit[:20]}' in POINT:UNITS; state it in corpus.markers.unit as one of "
            f"{', '.join(METRES)}, or in metres"
        )
    return metres, []


def _n_frames(
    parameters: dict[str, Value], in_header: tuple[int, int], frame_bytes: int, held_bytes: int, where: str
) -> int:
    """Return the number of frames; of the different statements of the file, that which agrees with its size."""
    first, last = in_header
    end = _long(parameters, "TRIAL:ACTUAL_END_FIELD", 0)
    stated = {
        "TRIAL:ACTUAL_END_FIELD": end - _long(parameters, "TRIAL:ACTUAL_START_FIELD", 1) + 1,
        "POINT:LONG_FRAMES": _count(parameters, "POINT:LONG_FRAMES", 0),
        "POINT:FRAMES": _count(parameters, "POINT:FRAMES", 0),
        "the header": last - first + 1,
    }
    counts = list(dict.fromkeys(count for count in stated.values() if count > 0))
    held = max(held_bytes, 0) // frame_bytes
    if counts and min(counts) > held:
        raise UserError(
            f"{where}: announces {min(counts)} frames and holds {held}: empty or truncated; copy or export it again"
        )
    fitting = [count for count in counts if count <= held and held_bytes - count * frame_bytes < SECTION]
    if len(counts) == 1 and counts[0] < MAX_IN_HEADER:
        fitting = counts  # something else follows the data
    saturated = last == MAX_IN_HEADER and max(end, *fitting, 0) >= MAX_IN_HEADER
    if not fitting or (stated["the header"] > fitting[0] and not saturated):
        said = " and ".join(f"{count} in {place}" for place, count in stated.items() if count > 0) or "none"
        raise UserError(f"{where}: announces {said}, but its data have room for {held} frames; export it again")
    return fitting[0]


def _long(parameters: dict[str, Value], name: str, default: int) -> int:
    """Return a number of 32 bits that is stored as two of 16 bits, the lower one first."""
    value = parameters.get(name)
    if not isinstance(value, np.ndarray) or not len(value) or not (np.abs(value[:2]) < 2**31).all():
        return default
    return int(value[0]) + (65536 * int(value[1]) if len(value) > 1 else 0)
