"""A talking head in front of cameras: its pose, blinking eyes and a mouth that opens, drawn frame by frame.

``render`` returns the images of a stereo pair; ``frames`` yields them one by one for films of any length.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Floats, Integers, Singles
from cospeech.geometry import rotation
from cospeech.geometry.camera import Camera, rays
from cospeech.studio import complexion, film, mannequin, paint, raster
from cospeech.studio.complexion import BLINKS, Texture
from cospeech.studio.mannequin import Mesh

Planes = npt.NDArray[np.uint8]

SUN = np.array([0.35, 0.45, 0.82])
AMBIENT = 0.45
"""Direction to the lamp, to the person's left, upward and forward, and share of the light that has no direction."""

NOISE = 1.5
"""Standard deviation of the sensor noise on a scale of 255."""

WALL_M = -1.0
"""Place of the wall behind the person along z."""


@dataclass(frozen=True)
class Acting:
    """What a head does, per frame.

    Attributes
    ----------
    angles_deg : (T, 3) angles x, y and z of R = Rx Ry Rz in degrees: nod (positive: down), turn (positive: to the
        person's left), and tilt (positive: towards the person's right shoulder).
    shift_m : (T, 3) displacement of the origin of the head, between the ears, to the person's left, upward and
        forward, metres.
    blink : (T,) how far the eyes are shut, 0 to 1.
    mouth : (T,) how far the mouth is open, 0 to 1.
    hand_m : (T, 3) place of the middle of a raised hand, NaN in frames without one; None if there is none at all.
    """

    angles_deg: Floats
    shift_m: Floats
    blink: Floats
    mouth: Floats
    hand_m: Floats | None = None


@dataclass(frozen=True)
class Appearance:
    """The look of one person: the mesh and its texture."""

    mesh: Mesh
    texture: Texture


def appearance(person: str, seed: int, contrast: float = 1.0) -> Appearance:
    """Return the look of a person, which the seed and the name determine.

    Parameters
    ----------
    contrast : factor of the contrast of the skin.
    """
    return Appearance(mannequin.mesh(complexion.SIZES), complexion.texture(person, seed, contrast))


def still(n_frames: int) -> Acting:
    """Return a head that does nothing for ``n_frames`` frames: neutral, with open eyes and a shut mouth."""
    return Acting(np.zeros((n_frames, 3)), np.zeros((n_frames, 3)), np.zeros(n_frames), np.zeros(n_frames))


def pivoted(angles_deg: Floats) -> Floats:
    """Return the displacement (..., 3) in metres of the origin of a head that turns about a point of the neck."""
    return mannequin.NECK_M - rotation.from_euler("XYZ", angles_deg) @ mannequin.NECK_M


def render(
    acting: Acting, looks: Appearance, cameras: Sequence[Camera], noise: float = NOISE, seed: int = 0
) -> list[Planes]:
    """Return the images of each camera, an array (T, 3, H, W) of full-range Y, Cb, Cr per camera.

    Parameters
    ----------
    acting : what the head does in T frames. The origin of the world is that of the head in its neutral pose.
    looks : the look of the person.
    cameras : the cameras, without lens distortion, such as ``stereo.cameras`` returns them.
    noise : standard deviation of the sensor noise on a scale of 255.
    seed : seed of the noise.
    """
    shots = [[view.copy() for view in views] for views in frames(acting, looks, cameras, noise, seed)]
    return [np.array(views) for views in zip(*shots, strict=True)]


def frames(
    acting: Acting, looks: Appearance, cameras: Sequence[Camera], noise: float = NOISE, seed: int = 0
) -> Iterator[list[Planes]]:
    """Yield the images of all cameras, each (3, H, W), frame by frame; see ``render``.

    The arrays are overwritten in every frame.
    """
    scene = _Scene(looks)
    scene.move(np.eye(3, dtype=np.float32), np.zeros(3, dtype=np.float32), 0.0, 0.0, np.full(3, np.nan))
    views = [_View(camera, scene, noise, seed) for camera in cameras]
    turns = rotation.from_euler("XYZ", acting.angles_deg).astype(np.float32)
    shifts = acting.shift_m.astype(np.float32)
    hands = np.full(shifts.shape, np.nan) if acting.hand_m is None else acting.hand_m
    for turn, shift, blink, mouth, hand in zip(turns, shifts, acting.blink, acting.mouth, hands, strict=True):
        scene.move(turn, shift, float(blink), float(mouth), hand)
        yield [view.shoot(scene) for view in views]


class _Scene:
    """The mesh in the pose of one frame, and the texture with the eyes of that frame."""

    def __init__(self, looks: Appearance) -> None:
        mesh = looks.mesh
        self._looks = looks
        self._mesh: list[Singles] = [
            values.astype(np.float32) for values in (mesh.places_m, mesh.normals, mesh.follows, mesh.jaw_m)
        ]
        self._sun = (SUN / np.linalg.norm(SUN)).astype(np.float32)
        self.texels = mesh.texels.astype(np.float32)
        hand = mesh.hand[mesh.triangles].all(axis=1)
        trunk = (mesh.follows[mesh.triangles] == 0.0).all(axis=1) & ~hand
        self.trunk, self.moving = mesh.triangles[trunk], mesh.triangles[~trunk & ~hand]
        self._without_hand, self._with_hand = self.moving, mesh.triangles[~trunk]
        self.texture = looks.texture.open.copy()
        self.seen = np.empty((len(mesh.places_m), 4), dtype=np.float32)

    def move(self, turn: Singles, shift: Singles, blink: float, mouth: float, hand_m: Floats) -> None:
        """Pose the head with a rotation (3, 3) and a displacement (3,), and set eyes, mouth and hand."""
        raster.pose(*self._mesh, np.float32(mouth), turn, shift, self._sun, np.float32(AMBIENT), self.seen)
        self.moving = self._without_hand if np.isnan(hand_m).any() else self._with_hand
        self.seen[self._looks.mesh.hand, :3] = self._mesh[0][self._looks.mesh.hand] + hand_m
        eyes = self._looks.texture.eyes[round(blink * BLINKS)]
        row, column = self._looks.texture.corner
        self.texture[row : row + eyes.shape[0], column : column + eyes.shape[1]] = eyes


class _View:
    """One camera: its image without the moving parts of the person, and its sensor."""

    def __init__(self, camera: Camera, scene: _Scene, noise: float, seed: int) -> None:
        width, height = camera.size_px
        self._rng = np.random.default_rng([seed, *camera.name.encode()])
        self._grain = film.grain(noise, self._rng)
        self._lens = (
            np.array(camera.focal_px, dtype=np.float32),
            np.array(camera.centre_px, dtype=np.float32),
            camera.rotation.astype(np.float32),
            np.array(camera.shift_m, dtype=np.float32),
        )
        self._behind, self._behind_depth = wall(camera), np.zeros((height, width), dtype=np.float32)
        self._draw(scene, scene.trunk, self._behind, self._behind_depth)
        self._picture, self._depth = np.empty_like(self._behind), np.empty_like(self._behind_depth)
        self._planes = np.empty((3, height, width), dtype=np.uint8)
        self._box = np.array([0, 0, width, height])

    def _draw(self, scene: _Scene, triangles: Integers, picture: Singles, depth: Singles) -> None:
        raster.draw(scene.seen, scene.texels, triangles, scene.texture, *self._lens, picture, depth)

    def shoot(self, scene: _Scene) -> Planes:
        """Return the image of the scene, which is overwritten by the next one."""
        self._picture[:], self._depth[:] = self._behind, self._behind_depth
        self._draw(scene, scene.moving, self._picture, self._depth)
        at = int(self._rng.integers(len(self._grain)))
        paint.expose(self._picture, self._grain, at, self._box, self._planes)
        return self._planes


def wall(camera: Camera) -> Singles:
    """Return Y, Cb, Cr (3, H, W) of the wall behind the person: grey-green, with stains, and lighter above."""
    width, height = camera.size_px
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).astype(float)
    ahead = rays(camera, grid)
    place = camera.place_m + (WALL_M - camera.place_m[2]) / ahead[..., 2:] * ahead
    x, y = place[..., 0], place[..., 1]
    stains = np.sin(23.0 * x + 3.0 * np.sin(17.0 * y)) + np.sin(19.0 * y + 2.0 * np.sin(29.0 * x))
    picture = np.empty((3, height, width), dtype=np.float32)
    picture[0] = 92.0 + 14.0 * y + 3.0 * stains
    picture[1], picture[2] = 126.0, 122.0
    return picture
