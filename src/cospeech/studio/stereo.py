"""The stereo camera of the studio: two identical, rectified cameras in front of a person's face."""

from __future__ import annotations

from cospeech.geometry.camera import Camera, look

SIZE_PX = (640, 480)
FPS = 30.0
FOCAL_PX = 800.0
CENTRE_PX = (322.5, 236.0)
"""Focal length and principal point in an image of ``SIZE_PX``."""

BASELINE_M = 0.10
DISTANCE_M = 0.75
HEIGHT_M = -0.045
"""Distance between the cameras, and from them to the face; height of the cameras above the middle of the head."""


def cameras(width_px: int = SIZE_PX[0]) -> list[Camera]:
    """Return the left and the right camera, as seen by themselves, with images ``width_px`` wide.

    A point at the depth Z in metres is ``focal length * BASELINE_M / Z`` pixels further to the right in the left
    image than in the right one, and in the same row.
    """
    scale = width_px / SIZE_PX[0]
    size = (width_px, round(scale * SIZE_PX[1]))
    centre = (scale * (CENTRE_PX[0] + 0.5) - 0.5, scale * (CENTRE_PX[1] + 0.5) - 0.5)
    pair = []
    for name, x in (("left", -BASELINE_M / 2), ("right", BASELINE_M / 2)):
        turn, shift = look(name, (x, HEIGHT_M, DISTANCE_M), (x, HEIGHT_M, 0.0))
        focal = scale * FOCAL_PX
        pair.append(
            Camera(
                name,
                size,
                (focal, focal),
                centre,
                turn=(turn[0], turn[1], turn[2]),
                shift_m=(shift[0], shift[1], shift[2]),
            )
        )
    return pair
