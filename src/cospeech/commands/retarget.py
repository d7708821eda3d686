"""``cospeech retarget``: motion on a skeleton of the user's own."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from cospeech.commands import convert
from cospeech.commands.messages import note
from cospeech.errors import UserError

if TYPE_CHECKING:
    from cospeech.commands.parser import Parser
    from cospeech.corpus.onto import Target
    from cospeech.data.arrays import Floats

WIDEST_DEG = 0.1
"""Largest angle between a limb of ours and that of the other skeleton."""

DESCRIPTION = """\
Move motion onto a skeleton of your own.

MOTION is motion of the skeleton of cospeech: a motion table, a BVH file that
cospeech wrote, or an SMPL-X file (npz). --to names a BVH or GLB file with your
skeleton; its rest pose is read from it, whatever it is (T, A, hanging arms). The
result is of the same kind: a BVH file with your joints, or a copy of your GLB file
with its mesh and the motion in place of its animations.

Limbs, trunk and head keep their directions, the path of the hips is scaled by the
length of the legs, and the lower foot stays as high above the floor as it is in
MOTION. Joints that have no counterpart keep their pose relative to their parent.

With --keep hands, the arms do not keep their directions but the hands their places
relative to the shoulders, scaled to your skeleton: hands that meet or touch in
MOTION do so on a body of any proportions."""

EPILOG = """\
examples:
  cospeech retarget gestures/speech.bvh --to avatar.glb --out speaking.glb
  cospeech retarget gestures/speech.bvh --to mine.bvh --unit cm --joints map.yaml \\
    --out mine_speaking.bvh

joints:
  Names of Mixamo, SMPL-X and cospeech are known. For others, write a YAML file with
  one line per joint, 'name of cospeech: your name', such as 'left_arm: L_UpperArm'.
  hips, chest, and arm, forearm, thigh, shin and foot of both sides are required."""


def add(commands: argparse._SubParsersAction[Parser]) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "retarget",
        usage="cospeech retarget MOTION --to SKELETON --out FILE [options]",
        help="move motion onto your own skeleton",
        description=DESCRIPTION,
        epilog=EPILOG,
    )
    parser.add_argument("motion", type=Path, metavar="MOTION", help="motion of the skeleton of cospeech")
    parser.add_argument("--to", type=Path, required=True, metavar="SKELETON", help="BVH or GLB file of your skeleton")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="file to write, of the same kind")
    parser.add_argument("--joints", type=Path, metavar="FILE", help="YAML file with the names of your joints")
    parser.add_argument(
        "--keep",
        choices=("directions", "hands"),
        default="directions",
        help="directions of the arms, or places of the hands relative to the shoulders (default: directions)",
    )
    parser.add_argument(
        "--up", choices=("y", "z"), default="y", help="axis of a BVH skeleton that points up (default: y)"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace an existing file")
    parser.set_defaults(execute=run)


def run(arguments: argparse.Namespace) -> int:
    """Retarget the motion, check it by forward kinematics of both bodies, and write it."""
    out, kind = arguments.out, arguments.to.suffix.lower()
    if kind not in (".bvh", ".glb"):
        raise UserError(f"{arguments.to}: is no skeleton that can be read; give a BVH or GLB file")
    convert.check_out(out, arguments.overwrite, (kind,))
    from cospeech.corpus import onto, onto_hands
    from cospeech.motion.body import STANDARD

    body, poses, fps = convert.read(arguments.motion, None, "m", "y")
    if body is not STANDARD:
        raise UserError(f"{arguments.motion}: has another skeleton than cospeech; give motion that cospeech wrote")
    target = _target(arguments.to, arguments.up)
    declared = None if arguments.joints is None else read_joints(arguments.joints)
    source = onto.joint_map(target.names, declared, target.where)
    onto.check_joints(source, target.where)
    if arguments.keep == "hands":
        onto_hands.check_joints(source, target.where)
    root, local = onto.retargeted(poses, target, source)
    worst = float(onto.limb_errors_deg(poses, target, source, local).max())
    if worst > WIDEST_DEG:
        raise UserError(
            f"{arguments.to}: its limbs deviate by up to {worst:.1f} degrees from those of the motion, as a limb has "
            "joints in between that bend in the rest pose; map the joints at which limbs bend with --joints"
        )
    kept = f"limbs point where those of the motion do, within {max(worst, 0.001):.3f} degrees"
    if arguments.keep == "hands":
        local, missed = onto_hands.kept(poses, target, source, root, local)
        share = f"{100 * missed.max():.1f} % of the length of an arm"
        kept = f"hands keep their places relative to the shoulders, within {share}"
    try:
        write(out, arguments.to, target, root, local, fps)
    except OSError as error:
        raise UserError(f"{out}: cannot be written ({error.strerror}); name another file with --out") from error
    note(kept)
    print(out, flush=True)
    return 0


def read_joints(path: Path) -> Mapping[str, str]:
    """Return the names of joints in a YAML file, by name of our joint.

    Raises
    ------
    UserError : if the file cannot be read, or is no list of names.
    """
    import yaml

    from cospeech.formats import foreign

    try:
        found = yaml.safe_load(foreign.decode(foreign.read_bytes(path), path))
    except yaml.YAMLError as error:
        raise UserError(f"{path}: is not YAML ({' '.join(str(error).split())[:100]}); correct it") from error
    if not isinstance(found, dict) or not all(isinstance(word, str) for pair in found.items() for word in pair):
        raise UserError(f"{path}: is no list of joints; write lines such as 'left_arm: L_UpperArm'")
    return found


def _target(path: Path, up: str) -> Target:
    import numpy as np

    from cospeech.corpus.onto import Target
    from cospeech.formats import bvh, glb

    if path.suffix.lower() == ".glb":
        body = glb.skeleton(path)
        return Target(body.names, body.parents, body.offsets_m, body.rotations, {}, "y", str(path))
    clip = bvh.read(path)
    if clip.offsets is None:
        raise UserError(f"{path}: has no offsets, and so no skeleton; export it again")
    still = np.tile(np.eye(3), (len(clip.names), 1, 1))
    return Target(clip.names, clip.parents, clip.offsets, still, clip.tips, up, str(path))


def write(out: Path, model: Path, target: Target, root: Floats, local: Floats, fps: float) -> None:
    """Write motion of another skeleton in the format of the file that brought it."""
    from cospeech.formats import bvh, glb, glb_writer
    from cospeech.geometry import rotation
    from cospeech.motion.library import Poses

    if out.suffix.lower() == ".bvh":
        bvh.write_clip(
            bvh.Clip(target.names, target.parents, local, {0: root}, fps, target.offsets, dict(target.tips)), out
        )
        return
    body = glb.skeleton(model)
    moved = Poses(root - body.offsets_m[0], rotation.to_quaternions(local))
    glb_writer.write_animation(out, model, out.stem, body, moved, fps)
