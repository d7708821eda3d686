"""Feed every reader of foreign files with mutilated files: python tests/fuzz.py [--seconds 600] [reader ...].

A reader may return a result or raise UserError with one line; anything else (another exception, a warning, more than
10 seconds, more than 4 GB, a crash) is printed and the file is kept. Each reader runs in a process of its own, which
is started again after a crash. tests/test_fuzz.py runs a few files of each reader in the suite.
"""

from __future__ import annotations

import argparse
import faulthandler
import io
import os
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import yaml

from cospeech.capture.tracking import footage
from cospeech.corpus import annotations, motion, user_tables
from cospeech.corpus.retarget import MotionConventions
from cospeech.data import project, segments, vocabulary
from cospeech.data.trajectories import Trajectories
from cospeech.errors import UserError
from cospeech.formats import audio, bvh, c3d, camera_toml, elan, films, glb_writer, mp4, sound, textgrid, trc
from cospeech.geometry.camera import Camera
from cospeech.motion import library, skeleton
from cospeech.motion.body import STANDARD
from cospeech.rendering import export
from cospeech.viewer import files as viewed
from cospeech.workflow import config, records

MAX_S, MAX_BYTES = 10, 4 << 30
"""Time in seconds and memory that a reader may take for one of these small files."""

LABELS = list(vocabulary.GESTURES)
OURS = MotionConventions("y", "m", "cospeech", "hanging")
SMPLX = MotionConventions("y", "m", "smplx", "t_pose")
RECORDING = annotations.Recording("a", 6.0)
SPANS = [(0.5, 2.0, "rest"), (2.0, 3.0, LABELS[-1]), (3.0, 4.5, "rest")]

NUMBERS = (
    b"0", b"-1", b"1", b"nan", b"inf", b"-inf", b"1e400", b"1e300", b"1e-320", b"99999999999999999999", b"", b"1,5",
    b"65536", b"2147483648", b"-2147483649", b"0x10", b"1_0", "\u0663".encode(), b"true", b"[]",
)  # fmt: skip
"""What replaces a number in a text."""

WORDS = (
    b"", b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"{", b"}", b"<", b"]]>", b"&x;", b'"', b"'", b"\n", b"\r", b"\t",
    b",", b";", b"../", b"\xc3\x28", "e\u0301".encode(), b"*a", b"&a [*a]", b"\\", b"%s", b"{0}",
)  # fmt: skip
"""What is inserted anywhere."""


class Reader(NamedTuple):
    """A reader: the suffix of its files, a function that writes a valid one, and one that reads it."""

    suffix: str
    write: Callable[[Path], object]
    read: Callable[[Path], object]


def _motion(n_frames: int = 30) -> pd.DataFrame:
    angles = np.random.default_rng(0).uniform(-30, 30, (n_frames, len(skeleton.JOINTS), 3))
    return skeleton.motion_table(np.zeros((n_frames, 3)), angles, 20.0)


def _markers(path: Path) -> None:
    places = np.random.default_rng(0).normal(0, 1, (12, 3, 3))
    places[3:5, 1] = np.nan
    write = c3d.write if path.suffix == ".c3d" else trc.write
    write(Trajectories(("chest", "left hand", "back"), places, 50.0), path)


def _npz(path: Path) -> None:
    rng = np.random.default_rng(0)
    poses = rng.uniform(-0.3, 0.3, (10, 165)).astype(np.float32)
    np.savez(path, poses=poses, trans=np.zeros((10, 3)), mocap_frame_rate=np.array(30), gender=np.array("neutral"))


def _gestures(path: Path) -> None:
    segments.from_starts("a", [0, 20, 50], ["rest", "left", "rest"], 90, 20.0).to_csv(path, index=False)


def _prosody() -> pd.DataFrame:
    rng = np.random.default_rng(0)
    largest = {"intensity": 1.7, "pitch_lag": 0.003, "pitch_gain": 1.0}
    columns = {name: rng.uniform(-most, most, 60) for name, most in largest.items()}
    columns |= {f"d_{name}": np.diff(values, prepend=values[0]) for name, values in columns.items()}
    return pd.DataFrame({"frame": np.arange(60), "time_s": segments.frame_times(60, 40.0), **columns})


def _annotations(path: Path) -> None:
    if path.suffix == ".eaf":
        elan.write(path, annotations.TIER, SPANS, LABELS, None)
    elif path.suffix == ".TextGrid":
        textgrid.write(path, annotations.TIER, SPANS, 6.0)
    else:
        pd.DataFrame(SPANS, columns=["start_s", "end_s", "gesture"]).to_csv(path, index=False)


def _sheet(path: Path) -> None:
    for name in ("a.bvh", "a.wav"):
        (path.parent / name).touch()
    files = path.parent / "a.bvh", path.parent / "a.wav"
    rows = [(f"r{number}", "ada", *files, number, number + 9) for number in (1, 2)]
    pd.DataFrame(rows, columns=["record", "actor", "motion", "audio", "start_s", "end_s"]).to_csv(path, index=False)


def _read_sheet(path: Path) -> object:
    settings = config.defaults()
    settings["corpus"] |= {"source": "recorded", "name": "mine", "records": str(path)}
    return records.records(settings, "results")


def _cameras(path: Path) -> None:
    cameras = [
        Camera(name, (960, 540), (900.0, 900.0), (480.0, 270.0), turn=(3.0, 0.1, 0.0), shift_m=(x, 1.0, 4.0))
        for name, x in (("left", -1.0), ("right", 1.0))
    ]
    path.write_text(camera_toml.toml(cameras), encoding="utf-8")


def _sound(path: Path) -> None:
    sound.write(0.3 * np.sin(np.arange(8000) / 20), path)


def _film(path: Path) -> None:
    images = (np.full((48, 64, 3), 8 * number, dtype=np.uint8) for number in range(12))
    mp4.encode(path, images, 25.0, (np.sin(np.arange(8000, dtype=np.float32) / 20), 16000))


def _read_film(path: Path) -> object:
    film = footage.probe(path)
    list(footage.brightness(film))
    return sum(1 for _ in films.pictures(path)), audio.read(path)


def _read_config(path: Path) -> None:
    try:
        given = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError):
        return  # Snakemake reads the file
    if isinstance(given, dict):
        config.check(config.defaults() | given)


def _body(path: Path) -> None:
    glb_writer.write(path, "talk", STANDARD, library.from_motion(_motion()), 20.0, export.surface(1))


READERS = {
    "bvh": Reader(".bvh", lambda path: bvh.write(_motion(), path), lambda path: motion.read(path, OURS)),
    "npz": Reader(".npz", _npz, lambda path: motion.read(path, SMPLX)),
    "glb": Reader(".glb", _body, viewed.read),
    "c3d": Reader(".c3d", _markers, c3d.read),
    "trc": Reader(".trc", _markers, trc.read),
    "motion_csv": Reader(".csv", lambda path: _motion().to_csv(path, index=False), user_tables.motion),
    "motion_parquet": Reader(".parquet", lambda path: _motion().to_parquet(path), user_tables.motion),
    "prosody_csv": Reader(
        ".csv", lambda path: _prosody().to_csv(path, index=False), lambda path: user_tables.prosody(path, 0.025)
    ),
    "gestures_csv": Reader(".csv", _gestures, lambda path: user_tables.gestures(path, "a", LABELS)),
    "elan": Reader(".eaf", _annotations, lambda path: annotations.read(path, RECORDING, LABELS)),
    "textgrid": Reader(".TextGrid", _annotations, lambda path: annotations.read(path, RECORDING, LABELS)),
    "annotations_csv": Reader(".csv", _annotations, lambda path: annotations.read(path, RECORDING, LABELS)),
    "sheet": Reader(".csv", _sheet, _read_sheet),
    "toml": Reader(".toml", _cameras, camera_toml.read),
    "wav": Reader(".wav", _sound, lambda path: (sound.read(path), audio.read(path))),
    "mp4": Reader(".mp4", _film, _read_film),
    "yaml": Reader(".yaml", lambda path: shutil.copy(project.root() / "config" / "demo.yaml", path), _read_config),
}  # fmt: skip


def mutilated(content: bytes, rng: np.random.Generator) -> bytes:
    """Return ``content`` with one to four random faults; those of a zip file are in its members, half of the time."""
    if content.startswith(b"PK") and rng.random() < 0.5:
        return _in_members(content, rng)
    for _ in range(rng.integers(1, 5)):
        content = _with_fault(content, rng)
    return content


def _in_members(content: bytes, rng: np.random.Generator) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as archive, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as changed:
        chosen = rng.choice(archive.namelist())
        for name in archive.namelist():
            member = archive.read(name)
            changed.writestr(name, _with_fault(member[:200], rng) + member[200:] if name == chosen else member)
    return file.getvalue()


def _with_fault(content: bytes, rng: np.random.Generator) -> bytes:
    if not content:
        return bytes(rng.integers(0, 256, rng.integers(0, 64), dtype=np.uint8))
    near = rng.random() < 0.5  # half of the faults are in the first kilobyte, where the headers are
    size = min(len(content), 1024) if near else len(content)
    start = int(rng.integers(0, size))
    end = min(len(content), start + int(2 ** rng.uniform(0, 10)))
    kind = rng.integers(0, 9)
    if kind == 0:  # flip bits
        changed = bytearray(content)
        for place in rng.integers(0, size, rng.integers(1, 9)):
            changed[place] ^= 1 << int(rng.integers(0, 8))
        return bytes(changed)
    if kind == 1:
        return content[:start]
    if kind == 2:  # a chunk twice
        return content[:end] + content[start:]
    if kind == 3:
        return content[:start] + content[end:]
    if kind == 4:  # a number of 8, 16 or 32 bits
        value = bytes([int(rng.choice([0, 1, 127, 128, 255]))]) * int(rng.choice([1, 2, 4]))
        return content[:start] + value + content[start + len(value) :]
    if kind in (5, 6):  # a number in a text
        numbers = list(re.finditer(rb"-?\d+(?:\.\d+)?", content[:size]))
        if numbers:
            found = numbers[int(rng.integers(0, len(numbers)))]
            return content[: found.start()] + NUMBERS[int(rng.integers(0, len(NUMBERS)))] + content[found.end() :]
    if kind == 7:  # lines exchanged, twice or dropped
        lines = content.splitlines(keepends=True)
        one, other = rng.integers(0, len(lines), 2)
        lines[one] = rng.choice([lines[other], b"", lines[one] * 2])
        return b"".join(lines)
    return content[:start] + WORDS[int(rng.integers(0, len(WORDS)))] + content[start:]


class HangError(Exception):
    """A reader took longer than ``MAX_S``."""


@contextmanager
def alarm() -> Iterator[None]:
    """Raise HangError in the block after ``MAX_S``."""

    def ring(number: int, frame: object) -> None:
        raise HangError

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(MAX_S)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def fault(reader: Reader, path: Path) -> str | None:
    """Read a file; return what is wrong with the way it ends, or None."""
    try:
        with alarm(), warnings.catch_warnings():
            warnings.simplefilter("error")
            reader.read(path)
    except UserError as error:
        return None if len(str(error).splitlines()) == 1 else f"message of several lines: {str(error)!r:.200}"
    except BaseException as error:  # a crash of Rust code is no Exception
        if isinstance(error, KeyboardInterrupt):
            raise
        last = traceback.extract_tb(error.__traceback__)
        own = [place for place in last if "cospeech" in place.filename] or last
        return f"{type(error).__name__}: {str(error)[:120]} ({Path(own[-1].filename).name}:{own[-1].lineno})"
    return None


def _kind(found: str) -> str:
    """Return what is the same for all files with one fault: the exception and its place, without its message."""
    what, _, message = found.partition(":")
    return what if what.startswith("message") else what + message[message.rfind("(") :]


def _work(name: str, seed: int, seconds: float, kept: Path) -> None:
    """Read mutilated files for some seconds; print each new fault and keep its file."""
    resource.setrlimit(resource.RLIMIT_AS, (MAX_BYTES, MAX_BYTES))
    faulthandler.enable()
    reader, seen, n_read = READERS[name], set(), 0
    with tempfile.TemporaryDirectory() as folder:
        valid = Path(folder, f"valid{reader.suffix}")
        reader.write(valid)
        reader.read(valid)
        content, rng = valid.read_bytes(), np.random.default_rng(seed)
        current = kept / f"{name}_{seed}_current{reader.suffix}"
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            faulthandler.dump_traceback_later(2 * MAX_S, exit=True)  # where the alarm cannot interrupt
            current.write_bytes(mutilated(content, rng))
            found = fault(reader, current)
            n_read += 1
            if found and (kind := _kind(found)) not in seen:
                seen.add(kind)
                case = kept / f"{name}_{seed}_{n_read}{reader.suffix}"
                shutil.copy(current, case)
                print(f"{name}: {found}\n    {case}", flush=True)
        faulthandler.cancel_dump_traceback_later()
        current.unlink()
    print(f"{name}: {n_read} files, {len(seen)} kinds of fault", flush=True)


def main() -> int:
    """Run the readers named on the command line, or all of them, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=600.0, help="time for each reader")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("readers", nargs="*", metavar="reader", help=", ".join(READERS))
    given = parser.parse_args()
    for name in given.readers:
        if name not in READERS:
            parser.error(f"unknown reader '{name}'; known are {', '.join(READERS)}")
    kept = Path(tempfile.mkdtemp(prefix="fuzz_"))
    for name in given.readers or READERS:
        seed, end = given.seed, time.monotonic() + given.seconds
        while (left_s := end - time.monotonic()) > 0:
            child = os.fork()
            if child == 0:
                try:
                    _work(name, seed, left_s, kept)
                finally:
                    sys.stdout.flush()
                    os._exit(0 if sys.exc_info()[0] is None else 1)
            _, status = os.waitpid(child, 0)
            if status:
                print(f"{name}: ended with status {status}\n    {kept}/{name}_{seed}_current{READERS[name].suffix}")
            seed += 1000
    faults = sorted(kept.iterdir())
    print(f"{len(faults)} files kept in {kept}" if faults else "no fault")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
