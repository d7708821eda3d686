"""The compiled part of filming a face: its pose, the jaw, and the mouth, for every pixel.

A pixel of the film is traced back to the plane of the face. The head is a paraboloid, so that it turns in depth. What
lies below the mouth moves with the jaw. In the mouth, four curves over u bound the lips: the outer and inner edges of
the upper and of the lower lip. Between the inner edges there are teeth, the tongue and the dark.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cospeech.data.arrays import Singles
from cospeech.kernels.jit import njit
from cospeech.studio.population.face import FINENESS, HALF_HEIGHT, HALF_WIDTH, REACH_U, REACH_V

DEPTH = np.float32(58.0)
"""How far the middle of the face is in front of its edge, in pixels of the film."""
SOLVING = 3
"""Number of iterations that find the point of the face in a pixel."""
DARK = (np.float32(34.0), np.float32(126.0), np.float32(138.0))
"""Y, Cb and Cr of the inside of the mouth."""
JAW = np.float32(0.7)
"""By how much the chin moves down, of the opening of the mouth."""
JAW_REACH = np.float32(1 / 22)
"""One over the distance from the mouth, in pixels, from which on all moves with the chin."""
HALF_WIDTH_SINGLE, HALF_HEIGHT_SINGLE = np.float32(HALF_WIDTH), np.float32(HALF_HEIGHT)
THREE, NEUTRAL, WHITE = np.float32(3.0), np.float32(128.0), np.float32(255.0)
ZERO, HALF, ONE, TWO = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0)

Single = np.float32
Shape = npt.NDArray[np.float32]


@njit
def cover(distance: Single) -> Single:
    """Return how much of a pixel is covered whose middle is at this signed distance from an edge, in pixels."""
    return min(max(HALF + distance, ZERO), ONE)


@njit
def mix(below: Single, above: Single, share: Single) -> Single:
    """Return a colour covered by another one."""
    return below + share * (above - below)


@njit
def bump(away: Single, width: Single) -> Single:
    """Return a soft bump of height 1."""
    return np.exp(-((away / width) ** 2))


@njit
def inside_mouth(u: Single, v: Single, top: Single, shape: Shape, c: int) -> Single:
    """Return channel ``c`` of a point between the lips; the inner edge of the upper one is at ``top``.

    The upper teeth hang from the skull, the lower ones and the tongue move with the jaw.
    """
    teeth, tooth, tongue_height, drop = shape[6], shape[7], shape[8], shape[9]
    x = u / shape[1]
    flat, dim, seam, low = ONE, ONE, ONE, ONE
    crown = abs(u / tooth - np.rint(u / tooth))
    if c == 0:
        flat = Single(0.72) + Single(0.28) * (ONE - HALF * x * x)
        dim = ONE - Single(0.45) * x * x
        seam = ONE - Single(1.4) * max(ZERO, crown - Single(0.40))
        low = Single(0.86)
    tongue = (drop - tongue_height) * (ONE - HALF * x * x)
    colour = mix(DARK[c], shape[16 + c] * flat, cover(v - tongue) * Single(0.9))
    colour = mix(colour, shape[13 + c] * seam * dim * low, cover(v - drop + Single(0.35) * teeth))
    edge = teeth - Single(1.2) * crown - shape[5]
    shade = min(ONE, Single(0.75) + Single(0.08) * (v - top)) if c == 0 else ONE
    return mix(colour, shape[13 + c] * seam * dim * shade, cover(edge - v))


@njit
def mouth(u: Single, v: Single, skin: Single, shape: Shape, c: int) -> Single:
    """Return channel ``c`` of a point (u, v) relative to the middle of the mouth, over the colour of the skin.

    ``shape`` (20,) holds: 0: open or not; 1: half width; 2, 3: thickness of upper and lower lip; 4: bow; 5: upper
    part of the opening; 6: teeth; 7: tooth; 8: height of the tongue; 9: lower part of the opening; 10-12: colour of
    the lips; 13-15: of the teeth; 16-18: of the tongue; 19: by how much the opening is larger on the right.
    """
    x = u / shape[1]
    arc = ONE - x * x
    if arc <= ZERO:
        return skin
    round_arc = np.sqrt(arc)
    opening = arc * (ONE + shape[19] * x)
    top, bottom = -shape[5] * opening, shape[9] * opening
    outer_top = top - shape[2] * HALF * (arc + round_arc) * (ONE - shape[4] * bump(x, Single(0.16)))
    outer_bottom = bottom + shape[3] * (Single(0.3) * arc + Single(0.7) * round_arc)
    if v < outer_top - TWO or v > outer_bottom + Single(6.0):
        return skin
    colour, lip = skin, shape[10 + c]
    if c == 0:
        colour *= ONE - Single(0.10) * arc * bump(v - outer_bottom - TWO, TWO)  # the shadow under the lower lip
        lip *= lip_light(u, v, x, top, bottom, outer_top, outer_bottom)
    colour = mix(colour, lip, cover(v - outer_top) * cover(outer_bottom - v))
    opened = cover(v - top) * cover(bottom - v)
    if opened > ZERO and bottom - top > Single(0.3):
        colour = mix(colour, inside_mouth(u, v, top, shape, c), opened * shape[0])
    seam = Single(0.55) * bump(v - HALF * (top + bottom), Single(0.9)) * (ONE - shape[0])
    return colour * (ONE - seam) if c == 0 else colour


@njit
def lip_light(
    u: Single, v: Single, x: Single, top: Single, bottom: Single, outer_top: Single, outer_bottom: Single
) -> Single:
    """Return the brightness of a lip: the upper one is in the shade, the lower one shines in its middle."""
    folds = ONE + Single(0.02) * np.sin(u * Single(1.3))
    if v < HALF * (top + bottom):
        return folds * (Single(0.78) + Single(0.10) * (v - top) / (outer_top - top - Single(0.01)))
    down = (v - bottom) / (outer_bottom - bottom + Single(0.01))
    shine = Single(0.20) * bump(down - HALF, Single(0.28)) * bump(x, HALF)
    return folds * (Single(0.95) + shine - Single(0.35) * max(ZERO, down - Single(0.7)))


@njit
def sample(layer: Singles, c: int, top: int, left: int, down: Single, right: Single) -> Single:
    """Return channel ``c`` of a layer between four pixels."""
    upper = mix(layer[c, top, left], layer[c, top, left + 1], right)
    lower = mix(layer[c, top + 1, left], layer[c, top + 1, left + 1], right)
    return mix(upper, lower, down)


@njit
def draw(
    planes: npt.NDArray[np.uint8], room: Singles, layer: Singles, pose: Singles, shape: Shape, height: np.float32,
    light: Singles, speckle: npt.NDArray[np.int8], at: int, steps: np.float32,
) -> None:  # fmt: skip
    """Draw a frame.

    Parameters
    ----------
    planes : (3, H, W) Y, Cb, Cr of the film; overwritten.
    room : (3, H, W) what is behind the head.
    layer : (4, V, U) the face without its mouth.
    pose : (8,) inverse (2, 2) of rotation and scale in the picture; shift per depth; x and y of the middle.
    shape : the mouth, see ``mouth``.
    height : v of the middle of the mouth.
    light : (6,) gain, its slopes over x and y from the middle to the edge, offset; shifts of Cb and Cr.
    speckle : noise in steps of 1 / ``steps``, of which as many as the film has values are used from place ``at`` on.
    """
    n_rows, n_columns = planes.shape[1:]
    fine, far_u, far_v = Single(FINENESS), Single(REACH_U), Single(REACH_V)
    last_row, last_column = layer.shape[1] - 1, layer.shape[2] - 1
    drop, jaw_width = JAW * shape[9], HALF_WIDTH_SINGLE * Single(1.1)
    for row in range(n_rows):
        y = Single(row) - pose[7]
        across = light[0] * (ONE + light[2] * (Single(row) * (TWO / Single(n_rows)) - ONE))
        for column in range(n_columns):
            x = Single(column) - pose[6]
            u, v = face_point(x, y, pose)
            below = min(max((v - height) * JAW_REACH, ZERO), ONE)
            side = u / jaw_width
            v_skin = v - drop * below * below * (THREE - TWO * below) * max(ZERO, ONE - side * side)
            place_u, place_v = (u + far_u) * fine - HALF, (v_skin + far_v) * fine - HALF
            left, top = int(np.floor(place_u)), int(np.floor(place_v))
            right, down = place_u - Single(left), place_v - Single(top)
            share = ZERO
            if left >= 0 and top >= 0 and left < last_column and top < last_row:
                share = sample(layer, 3, top, left, down, right)
            gain = across * (ONE + light[1] * (Single(column) * (TWO / Single(n_columns)) - ONE))
            for c in range(3):
                value = room[c, row, column]
                if share > ZERO:
                    skin = sample(layer, c, top, left, down, right)
                    value = mix(value, mouth(u, v - height, skin, shape, c), share)
                value = value * gain + light[3] if c == 0 else NEUTRAL + (value - NEUTRAL) * gain + light[3 + c]
                noise = Single(speckle[at + (c * n_rows + row) * n_columns + column]) / steps
                planes[c, row, column] = np.uint8(min(max(value + noise + HALF, ZERO), WHITE))


@njit
def face_point(x: Single, y: Single, pose: Singles) -> tuple[Single, Single]:
    """Return the point (u, v) of the paraboloid of the head that is seen at (x, y) from its middle."""
    u, v = pose[0] * x + pose[1] * y, pose[2] * x + pose[3] * y
    for _ in range(SOLVING):
        wide, high = u / HALF_WIDTH_SINGLE, v / HALF_HEIGHT_SINGLE
        z = DEPTH * max(-ONE, ONE - wide * wide - high * high)
        moved_x, moved_y = x - z * pose[4], y - z * pose[5]
        u, v = pose[0] * moved_x + pose[1] * moved_y, pose[2] * moved_x + pose[3] * moved_y
    return u, v
