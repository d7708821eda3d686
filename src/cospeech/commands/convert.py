"""``cospeech convert``: motion in another format."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from cospeech.commands.messages import note
from cospeech.errors import UserError

if TYPE_CHECKING:
    from cospeech.commands.parser import Parser
    from cospeech.motion.body import Body
    from cospeech.motion.library import Poses

FORMATS = {
    ".bvh": "joint angles for animation programs, in metres",
    ".glb": "binary glTF with a skinned body, for Blender, Unity, Unreal and browsers",
    ".npz": "SMPL-X, in the layout of BEAT2",
    ".parquet": "motion table of cospeech",
}
"""What can be written, by the end of the file's name."""

OWN_BODY = (".npz", ".parquet")
"""Formats that contain no skeleton: they can only hold motion of the skeleton of cospeech."""

DESCRIPTION = """\
Convert motion to another format.

MOTION is a motion table of cospeech, an SMPL-X file (npz), or a BVH or GLB file of
any skeleton. The suffix of --out chooses the format:

""" + "\n".join(f"  {suffix:<10}{what}" for suffix, what in FORMATS.items())

EPILOG = """\
examples:
  cospeech convert gestures/speech.bvh --out speech.glb
  cospeech convert results/demo/motion/ada_1.parquet --out ada_1.npz
  cospeech convert dance.glb --animation Walk --out walk.bvh

rest pose:
  Bodies of cospeech stand upright with hanging arms at zero angles, palms to the
  thighs, and face +z with y up; a BVH file has its offsets in that pose. SMPL-X is
  in a T-pose at zero angles. Keys of a GLB animation are at the centres of frames,
  and at its start and end, so that it lasts as long as the sound.

'cospeech retarget' moves motion onto a skeleton of your own."""


def add(commands: argparse._SubParsersAction[Parser]) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "convert",
        usage="cospeech convert MOTION --out FILE [options]",
        help="convert motion to BVH, GLB, SMPL-X or a table",
        description=DESCRIPTION,
        epilog=EPILOG,
    )
    parser.add_argument("motion", type=Path, metavar="MOTION", help="motion file")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="file to write")
    parser.add_argument("--animation", metavar="NAME", help="which animation of a GLB file (default: the only one)")
    parser.add_argument("--unit", choices=("m", "cm", "mm", "in"), default="m", help="unit of BVH files (default: m)")
    parser.add_argument("--up", choices=("y", "z"), default="y", help="axis of BVH files that points up (default: y)")
    parser.add_argument("--overwrite", action="store_true", help="replace an existing file")
    parser.set_defaults(execute=run)


def run(arguments: argparse.Namespace) -> int:
    """Convert the file."""
    out: Path = arguments.out
    check_out(out, arguments.overwrite, tuple(FORMATS))
    body, poses, fps = read(arguments.motion, arguments.animation, arguments.unit, arguments.up)
    from cospeech.motion.body import STANDARD

    if out.suffix.lower() in OWN_BODY and body is not STANDARD:
        raise UserError(f"{arguments.motion}: has a skeleton of its own, which {out.suffix} cannot hold; write .glb")
    try:
        write(out, body, poses, fps)
    except OSError as error:
        raise UserError(f"{out}: cannot be written ({error.strerror}); name another file with --out") from error
    note(f"{len(poses.root_m)} frames at {fps:g} frames per second, {len(body.joints)} joints")
    print(out, flush=True)
    return 0


def check_out(out: Path, overwrite: bool, suffixes: tuple[str, ...]) -> None:
    """Raise UserError if a file cannot be written, as it is there already or its suffix is not one of these."""
    if out.suffix.lower() not in suffixes:
        raise UserError(f"{out}: unknown format '{out.suffix}'; end the name with one of {', '.join(suffixes)}")
    if out.exists() and not (overwrite and out.is_file()):
        raise UserError(f"{out}: already exists; replace it with --overwrite, or name another file with --out")


def read(path: Path, animation: str | None, unit: str, up: str) -> tuple[Body, Poses, float]:
    """Return the body, the poses and the frame rate of the motion in a file.

    Raises
    ------
    UserError : if the file cannot be read or is not a motion file, if it has several animations and none is named, or
        if it has no animation of this name.
    """
    from cospeech.corpus import any_body
    from cospeech.viewer import files
    from cospeech.viewer.takes import Articulated

    kind = path.suffix.lower()
    if kind in (".c3d", ".trc"):
        raise UserError(f"{path}: contains markers and no joints; 'cospeech run markers' makes joint angles of them")
    if kind == ".glb":
        found = any_body.rigid(path, unit, up)
        named = {name.removeprefix(f"{path.stem}."): one for name, one in found.items()}
        if animation is not None and animation not in named:
            raise UserError(f"{path}: has no animation '{animation}'; its animations are {', '.join(named)}")
        if animation is None and len(named) > 1:
            raise UserError(f"{path}: has several animations; name one of {', '.join(named)} with --animation")
        return named[animation] if animation is not None else next(iter(named.values()))
    (version,) = files.read(path, unit, up)
    if isinstance(version.motion, Articulated):
        return version.motion.body, version.motion.poses, version.fps
    return next(iter(any_body.rigid(path, unit, up).values()))


def write(out: Path, body: Body, poses: Poses, fps: float) -> None:
    """Write motion in the format that the suffix of the file names."""
    import numpy as np

    from cospeech.formats import bvh, glb_writer, smplx
    from cospeech.geometry import rotation
    from cospeech.motion import library
    from cospeech.motion.body import STANDARD

    kind, own = out.suffix.lower(), body is STANDARD
    if kind == ".glb":
        from cospeech.rendering import export

        glb_writer.write(out, out.stem, body, poses, fps, export.surface() if own else None)
    elif kind == ".npz":
        from cospeech.corpus import smplx_poses

        smplx.write(out, *smplx_poses.from_poses(poses), fps)
    elif kind == ".parquet":
        from cospeech.data import tables
        from cospeech.workflow.job import settings_hash

        tables.write(library.to_motion(poses, fps), out, "motion", corpus="converted", config_hash=settings_hash({}))
    elif own:
        bvh.write(library.to_motion(poses, fps), out, fps)
    else:
        clip = bvh.Clip(
            body.joints,
            tuple(body.parents.tolist()),
            rotation.from_quaternions(poses.rotations),
            {0: np.asarray(poses.root_m + body.offsets_m[0])},
            fps,
            body.offsets_m,
        )
        bvh.write_clip(clip, out)
