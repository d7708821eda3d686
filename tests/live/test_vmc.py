"""Packets for avatars: their bytes, what a receiver shows, and receivers that come and go."""

import socket
import struct

import numpy as np
import pytest
from pythonosc.osc_packet import OscPacket

from cospeech.errors import UserError
from cospeech.geometry import rotation
from cospeech.live import vmc
from cospeech.motion import skeleton
from cospeech.motion.body import STANDARD, Body


def random_poses(n, seed=0):
    rng = np.random.default_rng(seed)
    quaternions = rng.normal(size=(n, 17, 4))
    quaternions /= np.linalg.norm(quaternions, axis=-1, keepdims=True)
    return np.concatenate([rng.normal(size=(n, 3)), quaternions.reshape(n, -1)], axis=1)


def hanging():
    pose = np.zeros(3 + 4 * 17)
    pose[3::4] = 1.0
    return pose


def message(address, tags, *values):
    """A message of Open Sound Control, by its definition."""

    def text(word):
        return word.encode() + b"\0" * (4 - len(word) % 4)

    data = text(address) + text(tags)
    for value in values:
        data += (
            text(value) if isinstance(value, str) else struct.pack(">i" if isinstance(value, int) else ">f", value)
        )
    return struct.pack(">i", len(data)) + data


def test_golden_packets():
    """An upright body with hanging arms, half a metre to its left: all bytes, in the order of the skeleton."""
    pose = hanging()
    pose[0] = 0.5
    first, second = (bytes(packet) for packet in vmc.Packets(STANDARD).fill(1.5, pose))
    down = np.float32(np.sqrt(0.5))
    sides = [
        (f"{side}{bone}", *place, *turn)
        for side, sign in (("Left", -1), ("Right", 1))
        for bone, place, turn in (
            ("UpperArm", (0.18 * sign, 0.19, 0.0), (0, 0, -sign * down, down)),
            ("LowerArm", (0.29 * sign, 0.0, 0.0), (0, 0, 0, 1)),
            ("Hand", (0.25 * sign, 0.0, 0.0), (0, 0, 0, 1)),
        )
    ]
    legs = [
        (f"{side}{bone}", *place, 0, 0, 0, 1)
        for side, sign in (("Left", -1), ("Right", 1))
        for bone, place in (
            ("UpperLeg", (0.09 * sign, -0.03, 0.0)),
            ("LowerLeg", (0, -0.43, 0)),
            ("Foot", (0, -0.42, 0)),
        )
    ]
    trunk = [
        ("Hips", -0.5, 0.95, 0, 0, 0, 0, 1),
        ("Spine", 0, 0.1, -0.01, 0, 0, 0, 1),
        ("Chest", 0, 0.16, -0.01, 0, 0, 0, 1),
        ("Neck", 0, 0.24, 0, 0, 0, 0, 1),
        ("Head", 0, 0.1, 0.02, 0, 0, 0, 1),
    ]
    bones = [
        message("/VMC/Ext/Bone/Pos", ",sfffffff", name, *map(float, numbers))
        for name, *numbers in (*trunk, *sides, *legs)
    ]
    head = b"#bundle\0" + struct.pack(">q", 1)
    start = (
        message("/VMC/Ext/OK", ",i", 1)
        + message("/VMC/Ext/T", ",f", 1.5)
        + message("/VMC/Ext/Root/Pos", ",sfffffff", "root", *[0.0] * 6, 1.0)
    )
    assert canonical(first) == canonical(head + start + b"".join(bones[:16]))
    assert canonical(second) == canonical(head + b"".join(bones[16:]))
    assert first.startswith(bytes.fromhex(
        "2362756e646c65000000000000000001"  # #bundle, at once
        "000000142f564d432f4578742f4f4b00" "2c690000" "00000001"  # /VMC/Ext/OK ,i 1
        "000000142f564d432f4578742f540000" "2c660000" "3fc00000"  # /VMC/Ext/T ,f 1.5
    ))  # fmt: skip


def canonical(packet):
    """The words of a packet, with the same zero everywhere."""
    words = [packet[k : k + 4] for k in range(0, len(packet), 4)]
    return [b"\0\0\0\0" if word == b"\x80\0\0\0" else word for word in words]


def received(packets):
    """Bones by name: position (3,) and rotation x, y, z, w."""
    bones = {}
    for packet in packets:
        for timed in OscPacket(bytes(packet)).messages:
            if timed.message.address == "/VMC/Ext/Bone/Pos":
                name, *numbers = timed.message.params
                bones[name] = np.array(numbers[:3]), np.array(numbers[3:])
    return bones


def shown(bones):
    """Positions of all bones as a receiver with a left-handed frame shows them, and orientations since the T-pose."""
    above = {vmc.BONES[name]: vmc.BONES.get(skeleton.PARENT[name]) for name in skeleton.JOINTS}
    places, turns = {}, {}
    for name in (vmc.BONES[joint] for joint in skeleton.JOINTS):
        place, (x, y, z, w) = bones[name]
        local = rotation.from_quaternions(np.array([w, x, y, z]))
        parent = above[name]
        if parent is None:
            places[name], turns[name] = place, local
        else:
            places[name] = places[parent] + turns[parent] @ place
            turns[name] = turns[parent] @ local
    return places, turns


@pytest.mark.parametrize("seed", range(10))
def test_a_receiver_shows_the_mirror_image_of_the_coordinates(seed):
    """In a left-handed frame the same body has the opposite x: joints, and the directions of all body parts."""
    poses = random_poses(5, seed)
    packets = vmc.Packets(STANDARD)
    mirror = np.diag([-1.0, 1.0, 1.0])
    t_pose = {
        "left": rotation.from_euler("Z", np.array([90.0])),
        "right": rotation.from_euler("Z", np.array([-90.0])),
    }
    turned, placed = STANDARD.world(poses[:, :3], poses[:, 3:].reshape(5, 17, 4))
    for frame, pose in enumerate(poses):
        places, turns = shown(received(packets.fill(0.0, pose)))
        for joint, name in enumerate(skeleton.JOINTS):
            side, _, part = name.partition("_")
            rest = t_pose[side] if part in ("arm", "forearm", "hand") else np.eye(3)
            np.testing.assert_allclose(places[vmc.BONES[name]], mirror @ placed[frame, joint], atol=1e-5)
            # a part of the T-pose, turned by the receiver, is the part of the hanging pose, turned by us
            np.testing.assert_allclose(
                turns[vmc.BONES[name]], mirror @ turned[frame, joint] @ rest.T @ mirror, atol=1e-5
            )


def test_the_t_pose_has_no_rotation():
    pose = hanging()
    for side, joint in (("left", 5), ("right", 8)):
        pose[3 + 4 * joint : 7 + 4 * joint] = vmc.T_POSE[side]
    for _, turn in received(vmc.Packets(STANDARD).fill(0.0, pose)).values():
        np.testing.assert_allclose(turn, [0, 0, 0, 1], atol=1e-7)


def test_packets_fit_the_network_and_are_overwritten_by_the_next_frame():
    packets = vmc.Packets(STANDARD)
    one, other = random_poses(2)
    kept = [bytes(packet) for packet in packets.fill(0.0, one)]
    assert max(map(len, kept)) <= vmc.MOST_BYTES
    assert [bytes(packet) for packet in packets.fill(0.0, other)] != kept
    assert [bytes(packet) for packet in packets.fill(0.0, one)] == kept


def test_bodies_that_are_no_avatars():
    with pytest.raises(UserError, match="starts at 'core'; leave VMC out with --vmc off"):
        vmc.Packets(Body(("core",), np.array([-1]), np.zeros((1, 3))))
    tail = Body(("hips", "tail", "head"), np.array([-1, 0, 0]), np.zeros((3, 3)))
    pose = np.zeros(15)
    pose[3::4] = 1.0
    assert list(received(vmc.Packets(tail).fill(0.0, pose))) == ["Hips", "Head"]


@pytest.fixture
def receiver():
    """A function that opens a receiver at a port of this machine, 0: any."""
    opened = []

    def listen(port=0):
        opened.append(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        opened[-1].bind(("127.0.0.1", port))
        opened[-1].settimeout(5.0)
        return opened[-1]

    yield listen
    for one in opened:
        one.close()


def test_a_receiver_gets_each_frame_and_may_disappear_and_return(receiver):
    there = receiver()
    port = there.getsockname()[1]
    said = []
    sender = vmc.Vmc(STANDARD, "127.0.0.1", port, said.append)
    poses = random_poses(12)
    expected = [[bytes(packet) for packet in vmc.Packets(STANDARD).fill(0.0, pose)] for pose in poses]

    def show(frame):
        sender.show(frame, 0.0, poses[frame])

    for frame in range(3):
        show(frame)
        assert [there.recv(2000) for _ in range(2)] == expected[frame]
    there.close()
    for frame in range(3, 6):
        show(frame)
    absent = f"nobody receives VMC at 127.0.0.1:{port} (Connection refused); start a receiver at any time"
    assert said == [absent]
    assert sender.n_lost >= 2
    back = receiver(port)
    for frame in range(6, 9):
        show(frame)
    assert said == [absent, f"VMC is received at 127.0.0.1:{port}"]
    got = [back.recv(2000) for _ in range(4)]
    assert got[-4:] == [packet for frame in (6, 7) for packet in expected[frame]] or got[-2:] == expected[7]
    sender.close()


def test_a_host_that_does_not_exist_is_refused():
    with pytest.raises(UserError, match=r"--vmc no\.such\.host\.invalid:39539: no such host"):
        vmc.Vmc(STANDARD, "no.such.host.invalid", 39539, print)
