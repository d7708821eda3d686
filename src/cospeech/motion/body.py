"""A body of any shape: its joints, their parents, and where they are; forward kinematics of its poses.

``skeleton`` describes the one body that all corpora are retargeted to. A motion library may move another one, human
or not. Rotations are unit quaternions w, x, y, z; a rotation in *parent space* is relative to the parent joint, one
in *world space* is the orientation of the joint in the world.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats, Integers
from cospeech.errors import UserError
from cospeech.geometry import rotation
from cospeech.motion import skeleton


@dataclass(frozen=True, eq=False)
class Body:
    """Joints of a body, parents first.

    Attributes
    ----------
    joints : (J,) names.
    parents : (J,) index of the parent of each joint, -1 for the root, which is the first joint.
    offsets_m : (J, 3) position of each joint in the frame of its parent in metres; that of the root is its position
        in the world when its displacement is zero.

    Raises
    ------
    UserError : if names are not unique, a joint other than the first has no parent before it, or an offset is not a
        number.
    """

    joints: tuple[str, ...]
    parents: Integers
    offsets_m: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "parents", np.ascontiguousarray(self.parents, dtype=np.int64))
        object.__setattr__(self, "offsets_m", np.ascontiguousarray(self.offsets_m, dtype=np.float64))
        n_joints = len(self.joints)
        if n_joints == 0 or self.parents.shape != (n_joints,) or self.offsets_m.shape != (n_joints, 3):
            raise UserError("a body needs at least one joint, and one parent and one offset (x, y, z) per joint")
        double = [name for name in self.joints if self.joints.count(name) > 1]
        if double:
            raise UserError(f"the body has several joints with the name '{double[0]}'; rename all but one")
        for index, (name, parent) in enumerate(zip(self.joints, self.parents.tolist(), strict=True)):
            if (parent != -1) if index == 0 else not 0 <= parent < index:
                raise UserError(
                    f"joint '{name}' of the body has an impossible parent; the first joint must be the only one "
                    "without a parent, and every parent must come before its children"
                )
            if not np.isfinite(self.offsets_m[index]).all():
                raise UserError(f"the offset of joint '{name}' of the body is not a number; correct it")

    def world(self, root_m: Floats, rotations: Floats) -> tuple[Floats, Floats]:
        """Return the orientations (T, J, 3, 3) and positions (T, J, 3) in metres of all joints in the world.

        Parameters
        ----------
        root_m : (T, 3) displacement of the root from its offset.
        rotations : (T, J, 4) quaternions w, x, y, z in parent space.
        """
        turned = rotation.from_quaternions(rotations)
        placed = np.empty((*turned.shape[:2], 3))
        placed[:, 0] = root_m + self.offsets_m[0]
        for joint in range(1, len(self.joints)):
            parent = self.parents[joint]
            turned[:, joint] = turned[:, parent] @ turned[:, joint]
            placed[:, joint] = placed[:, parent] + turned[:, parent] @ self.offsets_m[joint]
        return turned, placed

    def to_table(self) -> pd.DataFrame:
        """Return the body as a table of schema ``body``."""
        names = [None, *(self.joints[parent] for parent in self.parents[1:])]
        table = pd.DataFrame({"joint": self.joints, "parent": pd.Series(names, dtype=object)})
        table[["x_m", "y_m", "z_m"]] = self.offsets_m
        return table

    @classmethod
    def from_table(cls, table: pd.DataFrame) -> Body:
        """Return the body that ``to_table`` converted.

        Raises
        ------
        UserError : if a parent is not a joint, or the body is impossible for another reason.
        """
        joints = [str(name) for name in table["joint"]]
        parents = []
        for joint, parent in zip(joints, table["parent"], strict=True):
            if pd.notna(parent) and parent not in joints:
                raise UserError(f"joint '{joint}' has the parent '{parent}', which is not a joint of the body")
            parents.append(-1 if pd.isna(parent) else joints.index(str(parent)))
        return cls(tuple(joints), np.array(parents), table[["x_m", "y_m", "z_m"]].to_numpy(dtype=float))


STANDARD = Body(
    skeleton.JOINTS,
    np.array([-1 if joint.parent is None else skeleton.JOINTS.index(joint.parent) for joint in skeleton.BODY]),
    np.array([joint.offset_m for joint in skeleton.BODY]),
)
"""The body of ``skeleton``, which all corpora are retargeted to."""
