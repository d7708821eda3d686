"""The robust tracker: markers are predicted in 3D, measured in every view, and reacquired when lost.

In each frame: (1) each marker is predicted in 3D and projected into all views; (2) its disc is measured in a window
whose size reflects the uncertainty of the prediction; (3) a disc claimed by two markers is assigned to one of them;
(4) each marker is triangulated from the views that agree, using only views that see it well if there are at least
two; (5) markers without a point are reacquired as blobs of their colour in a wider window.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from cospeech.capture.tracking import reacquisition, rigid_parts
from cospeech.capture.tracking.colour import Unmixer
from cospeech.capture.tracking.detections import DETECTION_SD_M, JERK, Detections
from cospeech.capture.tracking.disc import UNKNOWN, WELL_SEEN, measure
from cospeech.capture.tracking.footage import Planes
from cospeech.data.arrays import Floats
from cospeech.geometry import kalman
from cospeech.geometry.camera import Camera
from cospeech.geometry.triangulate import consistent, packed, project_point, triangulate_packed
from cospeech.kernels.jit import njit
from cospeech.motion.markers import MARKERS, RADIUS_M

LEARNT = 0.02
"""Learning rate at which each whole disc updates the reference level and outline."""

REACH_SDS = 1.0
"""Search distance around the prediction in the first pass, in standard deviations."""

REACH_RADII = (0.4, 1.6)
"""Minimum and maximum search distance, in radii of the disc; the second pass uses the maximum."""

NEARLY_WHOLE = 0.75
"""Minimum visible area fraction at which an occluded disc is measured in the first pass."""

CUT_WEIGHT = 0.6
"""Weight of a view that sees a disc well, but not completely."""

PART_WEIGHT = 0.8
"""Weight of a view that sees less, times the squared visible fraction; used if fewer than two see the disc well."""

AGREE_RADII, AGREE_PX = 0.1, 0.8
"""Largest reprojection error at which views agree: the larger of a fraction of the disc's radius and a distance."""

OWN_RADII = 0.6
"""Minimum distance of two discs of one colour in one view, in radii; closer detections are the same disc."""

FARTHEST_STEP_M, STRAY_SDS = 0.12, 3.0
"""A point farther from its prediction than this distance and this many standard deviations is another marker."""

STILL_M = 0.01
"""Allowance added to ``STRAY_SDS`` for a point from two views, as a marker may start or stop abruptly."""

FOUND_SD = (2e-3, 1.0, 10.0)
"""Standard deviations of position, velocity and acceleration of a reacquired marker."""


@njit
def _expect(cameras: Floats, points: Floats, sd_m: Floats, radius_m: float) -> tuple[Floats, Floats, Floats]:
    """Return the projections (M, C, 2) of points (M, 3), the radii (M, C) and the search distances (M, C), pixels."""
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
    """Return the discs that two markers of one colour claim, as rows (n, 3) of both markers and the view."""
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
    colour: npt.NDArray[np.int64], expected: Floats, radius: Floats, reach: Floats, reference: Floats,
) -> tuple[Floats, npt.NDArray[np.int64], Floats]:  # fmt: skip
    """Return pixels (M, C, 2), numbers of pixels (M, C) and visible fractions (M, C) of the discs in all views.

    The first pass measures whole and nearly whole discs close to the prediction. For markers that fewer than two
    views see well, without a rival, the second pass also measures more occluded discs and searches farther away. The
    ``reference`` (colours, C, 2) of whole discs, see ``disc.measure``, is updated in place.
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
                known, inward = reference[colour[marker], view]
                x, y_found, count, whole, (light, drawn) = measure(
                    y, cb, cr, widths[view], across, share[marker], u, v, radius[marker, view], far,
                    0.0 if again else NEARLY_WHOLE, (known, inward),
                )  # fmt: skip
                pixels[marker, view] = x, y_found
                n_pixels[marker, view], share_seen[marker, view] = count, whole
                if whole == 1.0:
                    reference[colour[marker], view, 0] += (LEARNT if known > 0.0 else 1.0) * (light - known)
                    reference[colour[marker], view, 1] += LEARNT * (drawn - inward)
        well = share_seen >= WELL_SEEN
        for a, b, view in _rivals(pixels, radius, colour):
            well[a, view] = well[b, view] = False
        cut = well.sum(axis=1) < 2
    return pixels, n_pixels, share_seen


@njit
def _claim(
    cameras: Floats, own: Floats, weight: Floats, view: int, disc: Floats, expected: Floats, limit: float
) -> tuple[int, float]:
    """Return how badly a contested disc (2,) fits a marker whose other discs are ``own`` (C, 2): a rank and pixels.

    Rank 0: the point from its other discs projects there; 1: it agrees with the only other disc; 2: only the
    prediction is known; 3: it contradicts the other discs, or was already assigned to another marker. The pixels
    decide between equal ranks.
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
def _predict(states: Floats, covariances: Floats, transition: Floats, noise: Floats) -> None:
    """Predict the states and covariances (M, 3, 3) of all markers one frame ahead, in place."""
    for marker in range(len(states)):
        states[marker], covariances[marker] = kalman.predict(states[marker], covariances[marker], transition, noise)


@njit
def _update(states: Floats, covariances: Floats, hidden: npt.NDArray[np.int64], points: Floats) -> None:
    """Update the states and covariances with the points (M, 3), in place; count the frames since each was seen."""
    for marker in range(len(states)):
        hidden[marker] += 1
        if np.isfinite(points[marker, 0]):
            states[marker], covariances[marker] = kalman.update(
                states[marker], covariances[marker], points[marker], DETECTION_SD_M**2
            )
            hidden[marker] = 0


def weights(share_seen: Floats) -> Floats:
    """Return the weights (M, C) of views given the visible fractions (M, C) of the discs.

    If at least two views see a disc well, only these count.
    """
    well = share_seen >= WELL_SEEN
    part = PART_WEIGHT * np.square(share_seen)
    return np.where(
        well, np.where(share_seen < 1.0, CUT_WEIGHT, 1.0), np.where(well.sum(axis=1, keepdims=True) >= 2, 0.0, part)
    )


class RobustTracker:
    """Tracks the markers of one take.

    Parameters
    ----------
    cameras : the rig.
    first_m : (M, 3) the markers in the first frame, metres; NaN if unknown.
    unmixers : the unmixer of each marker colour.
    fps : frames per second.
    """

    def __init__(
        self,
        cameras: Sequence[Camera],
        first_m: Floats,
        unmixers: Mapping[str, Unmixer],
        fps: float,
    ) -> None:
        self.packed, self.first_m = packed(cameras), first_m
        self.lengths = reacquisition.link_lengths(first_m)
        self.widths = np.array([camera.size_px[0] for camera in cameras])
        self.across = unmixers["red"].across
        self.share = np.stack([unmixers[marker.colour].share for marker in MARKERS])
        names = sorted(unmixers)
        self.colour = np.array([names.index(marker.colour) for marker in MARKERS])
        self.reference = np.tile(UNKNOWN, (len(names), len(cameras), 1))
        self.transition, self.noise = kalman.motion_model(1.0 / fps, JERK)
        self.states = np.zeros((len(MARKERS), 3, 3))
        self.states[:, 0] = first_m
        self.covariances = np.tile(np.diag([2e-3**2, 0.3**2, 3.0**2]), (len(MARKERS), 1, 1))
        self.hidden = np.zeros(len(MARKERS), dtype=int)
        self.last_m = first_m.copy()
        self.started = False

    def step(
        self, pictures: Sequence[Planes], corrections: Sequence[tuple[int, int, float, float]] = ()
    ) -> Detections:
        """Return the markers of the next frame, given one image per camera.

        ``corrections`` are positions (marker, view, x, y) that a person set in this frame.
        """
        if self.started:
            _predict(self.states, self.covariances, self.transition, self.noise)
        self.started = True
        expected, radius, reach = _expect(
            self.packed, self.states[:, 0], np.sqrt(self.covariances[:, 0, 0]), RADIUS_M
        )
        pixels, n_pixels, share_seen = _measure(
            tuple(pictures),
            self.widths,
            self.across,
            self.share,
            self.colour,
            expected,
            radius,
            reach,
            self.reference,
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
        detections = Detections(pixels, n_pixels, corrected, used, points, residual)
        self._reacquire(detections, pictures, expected, radius, limit)
        _update(self.states, self.covariances, self.hidden, points)
        self._hold_hidden(points)
        away = np.linalg.norm(pixels - _expect(self.packed, points, np.zeros(len(points)), RADIUS_M)[0], axis=-1)
        pixels[~(away <= limit[:, None]) & ~corrected] = np.nan
        n_pixels[np.isnan(pixels[..., 0])] = 0
        return detections

    def _settle_owners(
        self,
        pixels: Floats,
        share_seen: Floats,
        corrected: npt.NDArray[np.bool_],
        expected: Floats,
        limit: Floats,
        rivals: npt.NDArray[np.int64],
    ) -> None:
        """Assign each disc that two markers claim to the marker whose other discs agree better with it."""
        own, own_share = pixels.copy(), share_seen.copy()
        own[rivals[:, :2], rivals[:, 2:]], own_share[rivals[:, :2], rivals[:, 2:]] = np.nan, 0.0
        own_weights = weights(own_share)
        for *claimants, view in rivals:
            claims = [
                _claim(
                    self.packed, own[marker], own_weights[marker], view, pixels[marker, view],
                    expected[marker, view], limit[marker],
                ) if not corrected[marker, view] else (-1, 0.0)
                for marker in claimants
            ]  # fmt: skip
            loser = claimants[claims.index(max(claims))]
            pixels[loser, view], share_seen[loser, view] = np.nan, 0.0

    def _reject(
        self,
        points: Floats,
        used: npt.NDArray[np.bool_],
        residual: Floats,
        corrected: npt.NDArray[np.bool_],
        limit: Floats,
    ) -> None:
        """Reject points that are too far from their prediction or violate a link, unless a person set them.

        A point from two views far from its prediction may rest on the disc of another marker. It is rejected too, so
        that reacquisition considers all discs there.
        """
        by_hand = (used & corrected).any(axis=1)
        away = np.linalg.norm(points - self.states[:, 0], axis=1)
        pair = used.sum(axis=1) == 2
        stray = STRAY_SDS * np.sqrt(self.covariances[:, 0, 0])
        allowed = np.where(pair, STILL_M + stray, np.maximum(FARTHEST_STEP_M, stray))
        points[((away > allowed) | (pair & (residual > reacquisition.PAIR_PART * limit))) & ~by_hand] = np.nan
        # Of two points that violate their link, reject the one that violates more links, or else is farther from its
        # prediction.
        while (violations := self.lengths.violations(points).sum(axis=1) * ~by_hand).any():
            worst = np.flatnonzero(violations == violations.max())
            points[worst[np.argmax(away[worst])]] = np.nan
        wrong = np.isnan(points[:, 0])
        used[wrong], residual[wrong] = False, np.nan

    def _reacquire(
        self, detections: Detections, pictures: Sequence[Planes], expected: Floats, radius: Floats, limit: Floats
    ) -> None:
        """Reacquire markers without a point, all of a colour together, and enter those found in ``detections``."""
        lost = np.isnan(detections.points_m[:, 0])
        near = STILL_M + STRAY_SDS * np.sqrt(self.covariances[:, 0, 0])
        search = reacquisition.search_radius_m(self.hidden, near)
        for colour in np.unique(self.colour[lost]):
            same = self.colour == colour
            members = np.flatnonzero(same & lost)
            found = reacquisition.reacquire(
                self.packed, self.widths, pictures, Unmixer(self.across, self.share[members[0]]),
                reacquisition.Lost(
                    members, self.states[members, 0], expected[members], radius[members],
                    search[members], near[members], self.reference[colour],
                ),
                _expect(self.packed, detections.points_m[same & ~lost], np.zeros(np.sum(same & ~lost)), RADIUS_M)[0],
                detections.points_m, self.lengths, float(np.median(limit[members])),
            )  # fmt: skip
            for marker, point in found.items():
                self._accept(marker, point, detections)

    def _accept(self, marker: int, found: reacquisition.Candidate, detections: Detections) -> None:
        """Put a lost marker that was found into ``detections``, and follow it from there."""
        point, used, rms = consistent(self.packed, found.pixels, weights(found.share_seen[None])[0], np.inf)
        detections.points_m[marker], detections.used[marker], detections.residual_px[marker] = point, used, rms
        detections.pixels[marker], detections.n_pixels[marker] = found.pixels, found.n_pixels
        # The velocity is known only if the marker was detected in the previous frame.
        speed = (point - self.last_m[marker]) / self.transition[0, 1] if self.hidden[marker] == 0 else 0.0
        self.states[marker, 0], self.states[marker, 1], self.states[marker, 2] = point, speed, 0.0
        self.covariances[marker] = np.diag(np.square(FOUND_SD))

    def _hold_hidden(self, points: Floats) -> None:
        """Hold hidden markers at their last position, subject to their rigid part or links to visible markers."""
        seen = np.isfinite(points[:, 0])
        self.last_m[seen] = points[seen]
        carried = rigid_parts.carried(self.first_m, points)
        held = np.isfinite(carried[:, 0])
        self.last_m = np.where(held[:, None], carried, self.lengths.clamp(self.last_m, points))
        self.states[~seen, 0], self.states[~seen, 1:] = self.last_m[~seen], 0.0
