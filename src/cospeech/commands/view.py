"""``cospeech view``: any motion in the 3D viewer, with sound."""

from __future__ import annotations

import argparse
import tempfile
import webbrowser
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from cospeech.commands.messages import note
from cospeech.errors import UserError

if TYPE_CHECKING:
    from cospeech.commands.parser import Parser
    from cospeech.viewer.takes import Take, Version
    from cospeech.viewer.voice import Voice

MOTION = (".bvh", ".c3d", ".csv", ".glb", ".npz", ".parquet", ".trc")

LONGEST_DIFFERENCE_S = 0.1
"""Durations of motion and sound that differ by more than this many seconds are reported to the user."""

DESCRIPTION = """\
Show motion in 3D, with sound.

FILES are motion of any skeleton: BVH, GLB, SMPL-X (npz), markers (C3D, TRC), or
motion tables of cospeech (Parquet, CSV); and at most one sound or film, which is
played along. Several motions are shown side by side, or overlaid. A GLB file is
shown with its own surface, and each of several animations in it by itself.

The page opens in the browser. With --out it is written to a file, which contains
everything and needs no connection."""

EPILOG = """\
examples:
  cospeech view gestures/speech.bvh speech.wav
  cospeech view mine.bvh theirs.glb --out compared.html
  cospeech view walk.bvh --unit cm --up z"""


def add(commands: argparse._SubParsersAction[Parser]) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "view",
        usage="cospeech view FILE... [options]",
        help="show motion files in 3D, with sound",
        description=DESCRIPTION,
        epilog=EPILOG,
    )
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="motion files, and a sound if you like")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the page to this HTML file")
    parser.add_argument("--overwrite", action="store_true", help="replace an existing file")
    parser.add_argument(
        "--unit", choices=("m", "cm", "mm", "in"), help="unit of BVH files, and of C3D files that do not state it"
    )
    parser.add_argument("--up", choices=("y", "z"), help="axis that points up (default: y, in C3D files z)")
    parser.set_defaults(execute=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the page, or open it."""
    out: Path | None = arguments.out
    if out is not None and out.exists() and not (arguments.overwrite and out.is_file()):
        raise UserError(f"{out}: already exists; replace it with --overwrite, or name another file with --out")
    sounds = [path for path in arguments.files if path.suffix.lower() not in MOTION]
    motions = [path for path in arguments.files if path not in sounds]
    if len(sounds) > 1:
        raise UserError(f"{sounds[1]}: is a second sound; give one sound, and motion files ({', '.join(MOTION)})")
    if not motions:
        raise UserError(f"no motion to show; name a motion file ({', '.join(MOTION)})")
    from cospeech.data import tables
    from cospeech.viewer import page

    content = page.page(", ".join(path.name for path in arguments.files), takes(motions, sounds, arguments))
    if out is None:
        with tempfile.NamedTemporaryFile(
            "w", prefix="cospeech-", suffix=".html", delete=False, encoding="utf-8"
        ) as file:
            file.write(content)
        if not webbrowser.open(Path(file.name).as_uri()):
            note("no browser could be opened; open this file in one, or write it elsewhere with --out")
        print(file.name, flush=True)
        return 0
    try:
        with tables.replacing(out) as temporary:
            temporary.write_text(content, encoding="utf-8")
    except OSError as error:
        raise UserError(f"{out}: cannot be written ({error.strerror}); name another file with --out") from error
    print(out, flush=True)
    return 0


def takes(motions: list[Path], sounds: list[Path], arguments: argparse.Namespace) -> list[Take]:
    """Return what the page shows: files with one motion together, and each animation of other files by itself."""
    from cospeech.viewer import files
    from cospeech.viewer.takes import Take

    heard = _voice(sounds[0]) if sounds else None
    together: list[Version] = []
    alone: list[tuple[str, Version]] = []
    for path in motions:
        versions = files.read(path, arguments.unit, arguments.up)
        for version in versions:
            _remark(path, version, sounds, heard)
        if len(versions) == 1:
            namesake = sum(other.stem == path.stem for other in motions) > 1
            together.append(replace(versions[0], title=path.name) if namesake else versions[0])
        else:
            alone += [(f"{path.stem}: {version.title}", version) for version in versions]
    shown = [(", ".join(version.title for version in together), together)] if together else []
    shown += [(title, [version]) for title, version in alone]
    if heard is None:
        return [Take(title, versions) for title, versions in shown]
    from cospeech.viewer.voice import CURVE_S

    return [
        Take(title, versions, heard.encoded, heard.duration_s, heard.curves, CURVE_S) for title, versions in shown
    ]


def _remark(path: Path, version: Version, sounds: list[Path], heard: Voice | None) -> None:
    """Tell the user of a still pose, and of a sound that does not last as long as the motion."""
    if version.motion.n_frames == 1:
        note(f"{path}: contains a single frame, which is shown as a still pose")
    motion_s = version.motion.n_frames / version.fps
    if heard is not None and abs(heard.duration_s - motion_s) > max(1 / version.fps, LONGEST_DIFFERENCE_S):
        note(
            f"{path}: {version.title} lasts {motion_s:.1f} s and {sounds[0]} {heard.duration_s:.1f} s; both start "
            "together, and whichever is shorter ends first"
        )


def _voice(path: Path) -> Voice:
    from cospeech.formats import audio
    from cospeech.viewer.voice import voice

    sound = audio.read(path)
    for remark in sound.notes:
        note(f"{path}: {remark}")
    return voice(sound.samples)
