"""The region of the face by its colour: a Gaussian in Cb and Cr, and the ellipse of the pixels that fit it.

Sargin 2006, section 4.1.1, 2D head localization.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from cospeech.capture.head.face import Box
from cospeech.data.arrays import Flags, Floats, Plane

SAMPLED = 0.6
"""Share of the width and height of a detected face, around its middle, from which the skin's colour is learned."""

REFINEMENTS = 3
"""How often outliers (brows, eyes, mouth) are left out of the sample."""

LIKELY = 9.21
"""Squared Mahalanobis distance within which 99 % of the skin lies (chi-squared, two degrees of freedom)."""

LEAST_SD = 2.0
"""Standard deviation of Cb and Cr below which the estimate is not trusted, as coding and noise add as much."""

MIN_FILLED = 0.01
"""Smallest share of a region that must have the colour of skin for it to show a face."""


class SkinColour(NamedTuple):
    """Mean (2,) and inverse covariance (2, 2) of Cb and Cr."""

    mean: Floats
    precision: Floats


class Ellipse(NamedTuple):
    """The ellipse with the first and second moments of a region.

    Attributes
    ----------
    middle : (2,) pixels.
    precision : (2, 2); the boundary has a squared Mahalanobis distance of 4 from the middle, as that of a filled
        ellipse has.
    """

    middle: Floats
    precision: Floats

    def contains(self, pixels: Floats, scale: float = 1.0) -> Flags:
        """Return which pixels (n, 2) lie in the ellipse enlarged ``scale`` times."""
        off = pixels - self.middle
        return np.einsum("ni,ij,nj->n", off, self.precision, off) <= 4.0 * scale * scale

    @property
    def half_axes_px(self) -> Floats:
        """The half axes (2,) in pixels, the longer first."""
        return 2.0 / np.sqrt(np.linalg.eigvalsh(self.precision))


def of_box(face: Box) -> Ellipse:
    """Return the ellipse inscribed in the box of a detected face."""
    half = np.array([face.width, face.bottom - face.top]) / 2
    return Ellipse(np.array(face.middle), np.diag(4.0 / half**2))


def learn(cb: Plane, cr: Plane, face: Box) -> SkinColour:
    """Return the colour of the skin in the middle of a detected face."""
    (x, y), width, height = face.middle, SAMPLED * face.width / 2, SAMPLED * (face.bottom - face.top) / 2
    rows = slice(max(0, round(y - height)), round(y + height))
    columns = slice(max(0, round(x - width)), round(x + width))
    sample = np.stack([cb[rows, columns].ravel(), cr[rows, columns].ravel()], axis=1).astype(float)
    typical = np.ones(len(sample), dtype=bool)
    for _ in range(REFINEMENTS):
        mean = sample[typical].mean(axis=0)
        precision = np.linalg.inv(np.cov(sample[typical].T) + LEAST_SD**2 * np.eye(2))
        off = sample - mean
        typical = np.einsum("ni,ij,nj->n", off, precision, off) < LIKELY
    return SkinColour(mean, np.asarray(precision, dtype=float))


def find_ellipse(cb: Plane, cr: Plane, region: Box, skin: SkinColour) -> Ellipse | None:
    """Return the ellipse of the largest connected area of skin in a region; None if there is next to none."""
    height, width = cb.shape
    left, top = max(0, int(region.left)), max(0, int(region.top))
    right, bottom = min(width, int(region.right)), min(height, int(region.bottom))
    if right - left < 8 or bottom - top < 8:
        return None
    blue = cb[top:bottom, left:right].astype(np.float32) - np.float32(skin.mean[0])
    red = cr[top:bottom, left:right].astype(np.float32) - np.float32(skin.mean[1])
    (a, b), (_, d) = skin.precision.astype(np.float32)
    likely = (a * blue * blue + 2 * b * blue * red + d * red * red < LIKELY).astype(np.uint8)
    likely = cv2.medianBlur(likely, 5)
    n_labels, labels, stats, _ = cv2.connectedComponentsWithStats(likely, connectivity=4)
    if n_labels < 2:
        return None
    largest = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    if stats[largest, cv2.CC_STAT_AREA] < MIN_FILLED * likely.size:
        return None
    moments = cv2.moments((labels == largest).astype(np.uint8), binaryImage=True)
    covariance = np.array([[moments["mu20"], moments["mu11"]], [moments["mu11"], moments["mu02"]]]) / moments["m00"]
    middle = np.array([left + moments["m10"] / moments["m00"], top + moments["m01"] / moments["m00"]])
    return Ellipse(middle, np.asarray(np.linalg.inv(covariance + np.eye(2)), dtype=float))
