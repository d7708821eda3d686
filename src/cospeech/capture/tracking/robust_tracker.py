"""The robust tracker: markers are predicted in the world, measured in every view, and found again when lost.

In each frame: (1) every marker is predicted in 3D and projected into all views; (2) its disc is centred in a window
as large as the prediction is unsure; (3) one disc has one owner; (4) the views that agree give the point, well-seen
views alone where there are two; (5) what was not found is sought as a blob of its colour in a wider window.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from cospeech.capture.tracking import reacquisition, rigid_parts
from cospeech.capture.tracking.colour import Mixer
from cospeech.capture.tracking.detections import JERK, SIGHT_SD_M, Sights
from cospeech.capture.tracking.disc import UNKNOWN, WELL_SEEN, measure
from cospeech.capture.tracking.footage import Planes
from cospeech.data.arrays import Floats
from cospeech.geometry import kalman
from cospeech.geometry.camera import Camera
from cospeech.geometry.triangulate import consistent, packed, project_point, triangulate_packed
from cospeech.kernels.jit import njit
from cospeech.motion.markers import MARKERS, RADIUS_M

LEARNT = 0.02
"""What a whole disc changes of the light and the outline that are expected of the next, in parts of its own."""

REACH_SDS = 1.0
"""A marker is first sought this many standard deviations around its prediction, then as far as it may be,"""

REACH_RADII = (0.4, 1.6)
"""but at least and at most this many of its radii."""

NEARLY_WHOLE = 0.75
"""Area, in areas of its outline, from which on a cut disc is measured of every marker."""

CUT_WEIGHT = 0.6
"""Weight of a view that sees a disc well, but not whole."""

PART_WEIGHT = 0.8
"""Weight of a view that sees less of a disc, where two do not see it well, times its share of outline squared."""

AGREE_RADII = 0.1
"""Views agree where they miss the point by less than this share of the disc's radius,"""

AGREE_PX = 0.8
"""or by less than this."""

OWN_RADII = 0.6
"""Two discs of one colour are never nearer than this in one view, in radii."""

FARTHEST_STEP_M = 0.12
"""A point farther than this from its prediction, and than ``STRAY_SDS``, is another marker's."""

STRAY_SDS = 3.0

STILL_M = 0.01
"""How far beyond that a marker at rest may be from its prediction, as it starts or stops without warning."""

COVER_FOUND = (2e-3, 1.0, 10.0)
"""Standard deviations of place, speed and acceleration of a marker that is found again."""


@njit
def _expect(cameras: Floats, points: Floats, sd_m: Floats, radius_m: float) -> tuple[Floats, Floats, Floats]:
    """Return the pixels (M, C, 2) of points (M, 3), their discs' radii (M, C) and how far to search (M, C), px."""
    n_markers, n_views = len(points), len(cameras)
    pixels, slope = np.empty((n_markers, n_views, 2)), np.empty((2, 3))
    radius, reach = np.empty((n_markers, n_views)), np.empty((n_markers, n_views))
    for marker in range(n_markers):
        for view in range(n_views):
            x, y, depth = project_point(cameras[view], points[marker], slope)
            pixels[marker, view] = x, y
            pixel_per_m = np.sqrt(cameras[view, 12] * cameras[view, 13]) / max(depth, 1e-6)
            size = radius_m * pixel_per_m
            radius[marker, view] = size
            far = REACH_SDS * sd_m[marker] * pixel_per_m
            reach[marker, view] = min(max(far, REACH_RADII[0] * size), REACH_RADII[1] * size)
    return pixels, radius, reach


@njit
def _rivals(pixels: Floats, radius: Floats, colour: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return the discs (n, 3) that two markers of a colour claim: both markers and the view, of pixels (M, C, 2)."""
    n_markers, n_views = pixels.shape[:2]
    found, count = np.empty((n_markers * n_markers * n_views, 3), dtype=np.int64), 0
    for a in range(n_markers):
        for b in range(a):
            for view in range(n_views if colour[a] == colour[b] else 0):
                apart = np.hypot(pixels[a, view, 0] - pixels[b, view, 0], pixels[a, view, 1] - pixels[b, view, 1])
                if apart < OWN_RADII * radius[a, view]:
                    found[count] = a, b, view
                    count += 1
    return found[:count]


@njit
def _measure(
    pictures: tuple[Planes, ...], widths: npt.NDArray[np.int64], across: Floats, share: Floats,
    colour: npt.NDArray[np.int64], expected: Floats, radius: Floats, reach: Floats, usual: Floats,
) -> tuple[Floats, npt.NDArray[np.int64], Floats]:  # fmt: skip
    """Return pixels (M, C, 2), counts and shares (M, C) of what the views show: (nearly) whole discs where expected.

    Of a marker that two views do not see well and for it alone, others and those farther off count too. What whole
    discs of each colour show in each view, ``usual`` (colours, C, 2) as in ``disc.measure``, is learnt in place.
    """
    n_markers, n_views = radius.shape
    pixels, n_pixels = np.full((n_markers, n_views, 2), np.nan), np.zeros((n_markers, n_views), dtype=np.int64)
    share_seen, cut = np.zeros((n_markers, n_views)), np.zeros(n_markers, dtype=np.bool_)
    for again in (False, True):
        for view in range(n_views):
            y, cb, cr = pictures[view]
            for marker in range(n_markers):
                u, v = expected[marker, view]
                somewhere = np.isfinite(u) and max(abs(u), abs(v)) < 1e5
                if share_seen[marker, view] > 0.0 or (again and not cut[marker]) or not somewhere:
                    continue
                far = REACH_RADII[1] * radius[marker, view] if again else reach[marker, view]
                known, inward = usual[colour[marker], view]
                x, y_found, count, whole, (light, drawn) = measure(
                    y, cb, cr, widths[view], across, share[marker], u, v, radius[marker, view], far,
                    0.0 if again else NEARLY_WHOLE, (known, inward),
                )  # fmt: skip
                pixels[marker, view] = x, y_found
                n_pixels[marker, view], share_seen[marker, view] = count, whole
                if whole == 1.0:
                    usual[colour[marker], view, 0] += (LEARNT if known > 0.0 else 1.0) * (light - known)
                    usual[colour[marker], view, 1] += LEARNT * (drawn - inward)
        well = share_seen >= WELL_SEEN
        for a, b, view in _rivals(pixels, radius, colour):
            well[a, view] = well[b, view] = False
        cut = well.sum(axis=1) < 2
    return pixels, n_pixels, share_seen


@njit
def _doubt(
    cameras: Floats, own: Floats, weight: Floats, view: int, disc: Floats, expected: Floats, limit: float
) -> tuple[int, float]:
    """Return how ill a disc (2,) in a view fits a marker with discs (C, 2) of its own: a rank, and pixels to rank by.

    0: two of its own lead there; 1: it meets the only one; 2: nothing is known but where it is expected; 3: it is
    not where its own discs say, or was lost to another marker.
    """
    point, used, _ = consistent(cameras, own, weight, limit)
    if used.any():
        x, y, _ = project_point(cameras[view], point, np.empty((2, 3)))
        off = np.hypot(disc[0] - x, disc[1] - y)
        return (0, off) if off <= limit else (3, off)
    if np.sum(weight > 0.0) == 1:
        both, equal = own.copy(), weight.copy()
        both[view], equal[view] = disc, 1.0
        _, used, off = consistent(cameras, both, equal, limit)
        return (1, off) if used.any() else (3, np.inf)
    off = np.hypot(disc[0] - expected[0], disc[1] - expected[1])
    return (2, off) if np.isfinite(off) else (3, np.inf)


@njit
def _predict(states: Floats, covers: Floats, move: Floats, noise: Floats) -> None:
    """Move the states and covariances (M, 3, 3) of all markers on by a frame, in place."""
    for marker in range(len(states)):
        states[marker], covers[marker] = kalman.predict(states[marker], covers[marker], move, noise)


@njit
def _update(states: Floats, covers: Floats, hidden: npt.NDArray[np.int64], points: Floats) -> None:
    """Take the points (M, 3) into the states and covariances, in place; count the frames that a marker is hidden."""
    for marker in range(len(states)):
        hidden[marker] += 1
        if np.isfinite(points[marker, 0]):
            states[marker], covers[marker] = kalman.update(
                states[marker], covers[marker], points[marker], SIGHT_SD_M**2
            )
            hidden[marker] = 0


def weights(share_seen: Floats) -> Floats:
    """Return the weights (M, C) of views that see discs to shares (M, C): only well-seen ones where there are two."""
    well = share_seen >= WELL_SEEN
    part = PART_WEIGHT * np.square(share_seen)
    return np.where(
        well, np.where(share_seen < 1.0, CUT_WEIGHT, 1.0), np.where(well.sum(axis=1, keepdims=True) >= 2, 0.0, part)
    )


class RobustTracker:
    """Follows the markers of one take.

    Parameters
    ----------
    cameras : the rig.
    first_m : (M, 3) the markers in the first frame, metres; NaN for one that is not known there.
    mixers : of every marker colour.
    fps : frames a second.
    """

    def __init__(
        self,
        cameras: Sequence[Camera],
        first_m: Floats,
        mixers: Mapping[str, Mixer],
        fps: float,
    ) -> None:
        self.packed, self.first_m = packed(cameras), first_m
        self.lengths = reacquisition.lengths(first_m)
        self.widths = np.array([camera.size_px[0] for camera in cameras])
        self.across = mixers["red"].across
        self.share = np.stack([mixers[marker.colour].share for marker in MARKERS])
        names = sorted(mixers)
        self.colour = np.array([names.index(marker.colour) for marker in MARKERS])
        self.usual = np.tile(UNKNOWN, (len(names), len(cameras), 1))
        self.move, self.noise = kalman.motion_model(1.0 / fps, JERK)
        self.states = np.zeros((len(MARKERS), 3, 3))
        self.states[:, 0] = first_m
        self.covers = np.tile(np.diag([2e-3**2, 0.3**2, 3.0**2]), (len(MARKERS), 1, 1))
        self.hidden = np.zeros(len(MARKERS), dtype=int)
        self.last_m = first_m.copy()
        self.started = False

    def step(self, pictures: Sequence[Planes], corrections: Sequence[tuple[int, int, float, float]] = ()) -> Sights:
        """Return the markers of the next frame, seen in one picture for each camera.

        ``corrections`` are (marker, view, x, y) that a person set for this frame.
        """
        if self.started:
            _predict(self.states, self.covers, self.move, self.noise)
        self.started = True
        expected, radius, reach = _expect(self.packed, self.states[:, 0], np.sqrt(self.covers[:, 0, 0]), RADIUS_M)
        pixels, n_pixels, share_seen = _measure(
            tuple(pictures), self.widths, self.across, self.share, self.colour, expected, radius, reach, self.usual
        )
        corrected = np.zeros(n_pixels.shape, dtype=bool)
        for marker, view, x, y in corrections:
            pixels[marker, view], share_seen[marker, view], corrected[marker, view] = (x, y), 1.0, True
        limit = np.maximum(AGREE_PX, AGREE_RADII * np.median(radius, axis=1))
        rivals = _rivals(pixels, radius, self.colour)
        if len(rivals):
            self._settle_owners(pixels, share_seen, corrected, expected, limit, rivals)
        points, used, residual = triangulate_packed(self.packed, pixels, weights(share_seen), limit)
        self._reject(points, used, residual, corrected, limit)
        sights = Sights(pixels, n_pixels, corrected, used, points, residual)
        self._recover(sights, pictures, expected, radius, limit)
        _update(self.states, self.covers, self.hidden, points)
        self._wait(points)
        away = np.linalg.norm(pixels - _expect(self.packed, points, np.zeros(len(points)), RADIUS_M)[0], axis=-1)
        pixels[~(away <= limit[:, None]) & ~corrected] = np.nan
        n_pixels[np.isnan(pixels[..., 0])] = 0
        return sights

    def _settle_owners(
        self,
        pixels: Floats,
        share_seen: Floats,
        corrected: npt.NDArray[np.bool_],
        expected: Floats,
        limit: Floats,
        rivals: npt.NDArray[np.int64],
    ) -> None:
        """Leave each disc that two markers claim to the one whose own discs lead to it."""
        own, own_share = pixels.copy(), share_seen.copy()
        own[rivals[:, :2], rivals[:, 2:]], own_share[rivals[:, :2], rivals[:, 2:]] = np.nan, 0.0
        own_weights = weights(own_share)
        for *claimants, view in rivals:
            doubts = [
                _doubt(
                    self.packed, own[marker], own_weights[marker], view, pixels[marker, view],
                    expected[marker, view], limit[marker],
                ) if not corrected[marker, view] else (-1, 0.0)
                for marker in claimants
            ]  # fmt: skip
            loser = claimants[doubts.index(max(doubts))]
            pixels[loser, view], share_seen[loser, view] = np.nan, 0.0

    def _reject(
        self,
        points: Floats,
        used: npt.NDArray[np.bool_],
        residual: Floats,
        corrected: npt.NDArray[np.bool_],
        limit: Floats,
    ) -> None:
        """Drop points that are too far from their prediction or off their bones, unless a person set them.

        Where two views meet far from the prediction, one may show another's disc: all discs there are to be weighed.
        """
        by_hand = (used & corrected).any(axis=1)
        away = np.linalg.norm(points - self.states[:, 0], axis=1)
        pair = used.sum(axis=1) == 2
        stray = STRAY_SDS * np.sqrt(self.covers[:, 0, 0])
        allowed = np.where(pair, STILL_M + stray, np.maximum(FARTHEST_STEP_M, stray))
        points[((away > allowed) | (pair & (residual > reacquisition.PAIR_PART * limit))) & ~by_hand] = np.nan
        # Of two points that do not fit each other, the one that fits fewer of the rest, or went farther, is wrong.
        while (misfits := self.lengths.misfits(points).sum(axis=1) * ~by_hand).any():
            worst = np.flatnonzero(misfits == misfits.max())
            points[worst[np.argmax(away[worst])]] = np.nan
        wrong = np.isnan(points[:, 0])
        used[wrong], residual[wrong] = False, np.nan

    def _recover(
        self, sights: Sights, pictures: Sequence[Planes], expected: Floats, radius: Floats, limit: Floats
    ) -> None:
        """Seek the markers without a point, those of a colour together, and put what is found into ``sights``."""
        lost = np.isnan(sights.points_m[:, 0])
        near = STILL_M + STRAY_SDS * np.sqrt(self.covers[:, 0, 0])
        search = reacquisition.search_radius_m(self.hidden, near)
        for colour in np.unique(self.colour[lost]):
            same = self.colour == colour
            members = np.flatnonzero(same & lost)
            found = reacquisition.seek(
                self.packed, self.widths, pictures, Mixer(self.across, self.share[members[0]]),
                reacquisition.Lost(
                    members, self.states[members, 0], expected[members], radius[members],
                    search[members], near[members], self.usual[colour],
                ),
                _expect(self.packed, sights.points_m[same & ~lost], np.zeros(np.sum(same & ~lost)), RADIUS_M)[0],
                sights.points_m, self.lengths, float(np.median(limit[members])),
            )  # fmt: skip
            for marker, point in found.items():
                self._take(marker, point, sights)

    def _take(self, marker: int, found: reacquisition.Found, sights: Sights) -> None:
        """Put a lost marker that was found into ``sights``, and follow it from there."""
        point, used, rms = consistent(self.packed, found.pixels, weights(found.share_seen[None])[0], np.inf)
        sights.points_m[marker], sights.used[marker], sights.residual_px[marker] = point, used, rms
        sights.pixels[marker], sights.n_pixels[marker] = found.pixels, found.n_pixels
        # One that was seen a frame ago is as fast as it went; of another, nothing is known.
        speed = (point - self.last_m[marker]) / self.move[0, 1] if self.hidden[marker] == 0 else 0.0
        self.states[marker, 0], self.states[marker, 1], self.states[marker, 2] = point, speed, 0.0
        self.covers[marker] = np.diag(np.square(COVER_FOUND))

    def _wait(self, points: Floats) -> None:
        """Let hidden markers rest where they were last seen, as far as the rest of the body does not carry them."""
        seen = np.isfinite(points[:, 0])
        self.last_m[seen] = points[seen]
        carried = rigid_parts.carried(self.first_m, points)
        held = np.isfinite(carried[:, 0])
        self.last_m = np.where(held[:, None], carried, self.lengths.held(self.last_m, points))
        self.states[~seen, 0], self.states[~seen, 1:] = self.last_m[~seen], 0.0
