"""Motion for avatars: the Virtual Motion Capture protocol (VMC), messages of Open Sound Control over UDP.

Unity, Unreal Engine, Blender, Godot, VSeeFace and others receive it, most with a plug-in (https://protocol.vmc.info).
Each frame consists of ``/VMC/Ext/OK``, ``/VMC/Ext/T`` (the time in seconds), ``/VMC/Ext/Root/Pos`` and one
``/VMC/Ext/Bone/Pos`` per bone, with position x, y, z in metres and rotation x, y, z, w in the frame of the parent
bone. They are sent in bundles that fit the packets of an Ethernet.

VRM avatars differ from the bodies of ``motion`` in two ways:

- Their rotations are relative to a T-pose, with the arms straight out to the side and palms down. Ours are relative
  to hanging arms. With T_j the rotation of a bone from hanging to T-pose, and p its parent, the local rotation is
  T_p R_j T_j^-1.
- Their frame is left-handed: x points to the avatar's right, y up, z forward. Positions (x, y, z) become (-x, y, z)
  and quaternions (w, x, y, z) become (w, x, -y, -z).

Packets differ from frame to frame only in their numbers. They are built once, and each frame writes its numbers.
"""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from contextlib import suppress

import numpy as np
import numpy.typing as npt
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message import OscMessage
from pythonosc.osc_message_builder import build_msg

from cospeech.data.arrays import Floats, Integers
from cospeech.errors import UserError
from cospeech.kernels.jit import njit
from cospeech.motion.body import Body

PORT = 39539
"""Port on which receivers of the protocol listen by default."""

MOST_BYTES = 1400
"""Largest packet: an Ethernet carries 1472 bytes of UDP, and tunnels somewhat less."""

BONES = {
    "hips": "Hips",
    "spine": "Spine",
    "chest": "Chest",
    "neck": "Neck",
    "head": "Head",
    **{
        f"{side}_{joint}": f"{side.capitalize()}{bone}"
        for side in ("left", "right")
        for joint, bone in (
            ("arm", "UpperArm"),
            ("forearm", "LowerArm"),
            ("hand", "Hand"),
            ("thigh", "UpperLeg"),
            ("shin", "LowerLeg"),
            ("foot", "Foot"),
        )
    },
}
"""The bone of a VRM avatar that corresponds to each joint."""

HALF = np.sqrt(0.5)
T_POSE = {"left": np.array([HALF, 0.0, 0.0, HALF]), "right": np.array([HALF, 0.0, 0.0, -HALF])}
"""Rotation w, x, y, z of each arm from hanging down to the T-pose."""

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])

Note = Callable[[str], None]


@njit
def _product(a: Floats, b: Floats) -> tuple[float, float, float, float]:
    """Return the product of two quaternions."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@njit
def _convert(
    pose: Floats, joints: Integers, before: Floats, after: Floats, places: Floats, numbers: npt.NDArray[np.float32]
) -> None:
    """Write position x, y, z and rotation x, y, z, w of each bone to ``numbers`` (B, 7).

    Parameters
    ----------
    pose : (3 + 4 J,) frame.
    joints : (B,) joint of each bone; the first one is the root.
    before, after : (B, 4) T_p and T_j^-1 of each bone.
    places : (B, 3) position of each bone in the frame of its parent, left-handed; of the root, without displacement.
    """
    half = np.empty(4)
    for bone in range(len(joints)):
        start = 3 + 4 * joints[bone]
        half[0], half[1], half[2], half[3] = _product(before[bone], pose[start : start + 4])
        w, x, y, z = _product(half, after[bone])
        for axis in range(3):
            numbers[bone, axis] = places[bone, axis]
        numbers[bone, 3], numbers[bone, 4], numbers[bone, 5], numbers[bone, 6] = x, -y, -z, w
    numbers[0, 0] = places[0, 0] - pose[0]
    numbers[0, 1] = places[0, 1] + pose[1]
    numbers[0, 2] = places[0, 2] + pose[2]


class Packets:
    """The packets of a frame.

    Parameters
    ----------
    body : the body that moves. Joints that no VRM avatar has are left out.

    Raises
    ------
    UserError : if the root of the body is not its hips, which it is in VRM avatars.
    """

    def __init__(self, body: Body) -> None:
        if body.joints[0] != "hips":
            raise UserError(
                f"VMC moves avatars with human bones, but the body of this model starts at '{body.joints[0]}'; "
                "leave VMC out with --vmc off, and record its motion with --record"
            )
        known = [joint for joint, name in enumerate(body.joints) if name in BONES]
        turned = np.array([T_POSE.get(name.partition("_")[0], UPRIGHT) for name in body.joints])
        legs = [joint for joint, name in enumerate(body.joints) if name.endswith(("_thigh", "_shin", "_foot"))]
        turned[legs] = UPRIGHT
        above = [int(body.parents[joint]) for joint in known]
        self._joints = np.array(known)
        self._before = np.array([UPRIGHT if parent < 0 else turned[parent] for parent in above])
        self._after = turned[known] * [1.0, -1.0, -1.0, -1.0]
        offsets = [_turned(start, body.offsets_m[joint]) for start, joint in zip(self._before, known, strict=True)]
        self._places = np.round(np.array(offsets) * [-1.0, 1.0, 1.0], 9)
        self._numbers = np.zeros((len(known), 7), dtype=np.float32)
        bones = [build_msg("/VMC/Ext/Bone/Pos", [BONES[body.joints[joint]], *[0.0] * 7]) for joint in known]
        root = build_msg("/VMC/Ext/Root/Pos", ["root", *[0.0] * 6, 1.0])
        head = [build_msg("/VMC/Ext/OK", [1]), build_msg("/VMC/Ext/T", [0.0]), root]
        self._bundles = [_bundle(messages) for messages in _together(head + bones)]
        self._words = [np.frombuffer(bundle, ">f4") for bundle in self._bundles]
        self._where = [_numbers_at(bundle) for bundle in self._bundles]
        self._time_at = _time_at(self._bundles[0])
        self.fill(0.0, np.zeros(3 + 4 * len(body.joints)))  # loads the kernel

    def fill(self, time_s: float, pose: Floats) -> list[bytearray]:
        """Return the packets of a frame; the next call overwrites them.

        Parameters
        ----------
        time_s : time of the frame in seconds.
        pose : (3 + 4 J,) root position in metres, and the rotations w, x, y, z of the joints in parent space.
        """
        _convert(pose, self._joints, self._before, self._after, self._places, self._numbers)
        self._words[0][self._time_at] = time_s
        first = 0
        for words, where in zip(self._words, self._where, strict=True):
            words[where] = self._numbers[first : first + len(where)]
            first += len(where)
        return self._bundles


def _turned(quaternion: Floats, vector: Floats) -> Floats:
    """Return a vector (3,) rotated by a quaternion w, x, y, z."""
    w, axis = quaternion[0], quaternion[1:]
    return np.asarray(vector + 2.0 * np.cross(axis, np.cross(axis, vector) + w * vector))


def _together(messages: list[OscMessage]) -> Iterator[list[OscMessage]]:
    """Yield the messages in groups whose bundles are not larger than a packet."""
    group: list[OscMessage] = []
    size = HEADER
    for message in messages:
        if group and size + 4 + message.size > MOST_BYTES:
            yield group
            group, size = [], HEADER
        group.append(message)
        size += 4 + message.size
    yield group


HEADER = 16
"""Length of the beginning of a bundle: its name and time."""


def _bundle(messages: list[OscMessage]) -> bytearray:
    builder = OscBundleBuilder(IMMEDIATELY)
    for message in messages:
        builder.add_content(message)
    return bytearray(builder.build().dgram)


def _contents(bundle: bytearray) -> Iterator[tuple[bytes, int]]:
    """Yield the address of each message of a bundle, and where it ends in 32-bit words."""
    place = HEADER
    while place < len(bundle):
        end = place + 4 + int.from_bytes(bundle[place : place + 4], "big")
        yield bytes(bundle[place + 4 : end]).split(b"\0")[0], end // 4
        place = end


def _numbers_at(bundle: bytearray) -> Integers:
    """Return where the seven numbers of each bone are in a bundle, (B, 7), in 32-bit words."""
    ends = [end for address, end in _contents(bundle) if address == b"/VMC/Ext/Bone/Pos"]
    return np.array(ends, dtype=np.int64).reshape(-1, 1) + np.arange(-7, 0)


def _time_at(bundle: bytearray) -> int:
    """Return where the time is in a bundle, in 32-bit words."""
    return next(end - 1 for address, end in _contents(bundle) if address == b"/VMC/Ext/T")


class Vmc:
    """Sends frames to a receiver. Frames that nobody receives are lost, and the others go on.

    Parameters
    ----------
    body : the body that moves.
    host, port : the receiver.
    note : says in one line that the receiver is absent, or is back.

    Raises
    ------
    UserError : if the body is not human, or there is no such host.

    Attributes
    ----------
    n_lost : number of frames that could not be sent.
    """

    in_real_time = True

    def __init__(self, body: Body, host: str, port: int, note: Note) -> None:
        self._packets = Packets(body)
        self._where, self._note = f"{host}:{port}", note
        self._absent = False
        self.n_lost = 0
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        except OSError as error:
            raise UserError(f"--vmc {self._where}: no such host ({error.strerror}); correct its name") from error
        self._socket = socket.socket(family, kind, protocol)
        self._socket.setblocking(False)
        try:
            self._socket.connect(address)  # only then does the system report that nobody listens
        except OSError as error:
            self._socket.close()
            raise UserError(
                f"--vmc {self._where}: cannot be reached ({error.strerror}); name another host"
            ) from error

    def show(self, frame: int, time_s: float, pose: Floats) -> None:
        """Send a frame; see ``outputs.Output``."""
        failed = None
        for packet in self._packets.fill(time_s, pose):
            failed = self._send(packet) or failed
        if failed is not None:
            self.n_lost += 1
            if not self._absent:
                self._note(f"nobody receives VMC at {self._where} ({failed}); start a receiver at any time")
        elif self._absent:
            self._note(f"VMC is received at {self._where}")
        self._absent = failed is not None

    def _send(self, packet: bytearray) -> str | None:
        """Send a packet, and return why this failed, or why an earlier one did not arrive."""
        try:
            self._socket.send(packet)
        except ConnectionRefusedError as error:
            with suppress(OSError):
                self._socket.send(packet)  # the error was that of an earlier packet, and this one was not sent
            return error.strerror
        except OSError as error:
            return error.strerror
        return None

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
