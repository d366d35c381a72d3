"""Saddles of the grey levels: where two dark and two light squares meet, and what looks like it.

On a small ring around the crossing of two edges the grey levels are the same after half a turn and
mirrored about the middles of the light squares. What is curved at the saddle itself tells these
middles, but not the angle between the edges: a round blur makes it look like a right one always.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye_cli.records import FloatArray, GreyImage

_BLUR = 1.0
"""Standard deviation of the smoothing, pixels; the noise is to have few saddles."""
_LEAST = 4.0
"""Smallest product of the curvatures of a saddle, squared grey levels per pixel to the fourth."""
_APART = 5
"""Side of the square in which a saddle is the strongest, pixels."""
_MOST = 6000
"""Strongest of them that are looked at."""
_RING, _SAMPLES = 3.0, 32
"""Radius of the ring in pixels, less than a square, and points on it."""
_ALIKE = 0.7
"""Least share of the ring's variance that is the same in all four quarters."""
_FAINT = 3.0
"""Smallest amplitude on the ring, grey levels."""
_FARTHEST = 1.5
"""Pixels by which the saddle's middle may be off the pixel that is the strongest."""


@dataclass(frozen=True)
class Saddles:
    """Saddles in an image.

    Attributes:
        centres: (n, 2) pixels.
        edges: (n, 2) angles of the two edges, radians from x to y. Turning from the first to the
            second, which is less than half a turn on, one crosses a light square.
        contrast: (n,) amplitude of the grey levels around.
    """

    centres: FloatArray
    edges: FloatArray
    contrast: FloatArray

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.centres)


def find_saddles(grey: GreyImage) -> Saddles:
    """Return the saddles of a (height, width) image that look like corners of squares."""
    blurred = cv2.GaussianBlur(grey.astype(np.float32), (0, 0), _BLUR)
    smooth = np.asarray(blurred, dtype=np.float32)
    bends = [cv2.Sobel(smooth, cv2.CV_32F, *each, scale=0.25) for each in ((2, 0), (1, 1), (0, 2))]
    strength = bends[1] * bends[1] - bends[0] * bends[2]
    window = np.ones((_APART, _APART), dtype=np.uint8)
    peak = (strength == cv2.dilate(strength, window)) & (strength > _LEAST)
    row, column = np.nonzero(peak[1:-1, 1:-1])
    row, column = row + 1, column + 1
    if len(row) > _MOST:
        strongest = np.argpartition(-strength[row, column], _MOST)[:_MOST]
        row, column = row[strongest], column[strongest]
    slope = [
        0.5 * (smooth[row, column + 1] - smooth[row, column - 1]),
        0.5 * (smooth[row + 1, column] - smooth[row - 1, column]),
    ]
    uu, uv, vv = (bend[row, column].astype(np.float64) for bend in bends)
    # Newton's step to where the grey levels are even.
    away = np.stack([vv * slope[0] - uv * slope[1], uu * slope[1] - uv * slope[0]], axis=1)
    away /= (uv * uv - uu * vv)[:, None]
    centres = np.stack([column, row], axis=1) + np.clip(away, -1.0, 1.0)
    light = 0.5 * np.arctan2(2.0 * uv, uu - vv)
    level = _ring(smooth, centres, light)
    profile = _folded(level)
    contrast = 0.5 * (profile[:, 0] - profile[:, -1])
    good = (_sameness(level, profile) > _ALIKE) & (contrast > _FAINT)
    good &= (np.abs(away) < _FARTHEST).all(axis=1)
    aside = _crossed(profile[good])
    edges = np.stack([light[good] - aside, light[good] + aside], axis=1)
    return Saddles(centres[good], edges, contrast[good])


def _ring(smooth: NDArray[np.float32], centres: FloatArray, first: FloatArray) -> FloatArray:
    """Return the (n, samples) grey levels on rings around (n, 2) centres, from (n,) angles on."""
    angle = first[:, None] + 2.0 * np.pi * np.arange(_SAMPLES) / _SAMPLES
    u = (centres[:, :1] + _RING * np.cos(angle)).astype(np.float32)
    v = (centres[:, 1:] + _RING * np.sin(angle)).astype(np.float32)
    if u.size == 0:
        return np.zeros(u.shape)
    level = cv2.remap(smooth, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(level, dtype=np.float64)


def _folded(level: FloatArray) -> FloatArray:
    """Return the (n, quarter + 1) means of what is equally far from the light squares' middles."""
    half, quarter = _SAMPLES // 2, _SAMPLES // 4
    both = 0.5 * (level[:, :half] + level[:, half:])
    back = both[:, -np.arange(quarter + 1)]
    return 0.5 * (both[:, : quarter + 1] + back)


def _sameness(level: FloatArray, profile: FloatArray) -> FloatArray:
    """Return the (n,) shares of the rings' variance that the folded profiles explain."""
    place = np.arange(_SAMPLES) % (_SAMPLES // 2)
    left = level - profile[:, np.minimum(place, _SAMPLES // 2 - place)]
    whole = level - level.mean(axis=1, keepdims=True)
    squares = np.maximum(np.sum(whole**2, axis=1), 1e-9)
    return np.asarray(1.0 - np.sum(left**2, axis=1) / squares)


def _crossed(profile: FloatArray) -> FloatArray:
    """Return the (n,) angles from the light squares' middle to where the profile is half way."""
    above = profile - 0.5 * (profile[:, :1] + profile[:, -1:])
    after = np.argmax(above < 0, axis=1)
    near = above[np.arange(len(above)), after - 1]
    far = above[np.arange(len(above)), after]
    return np.asarray((after - far / (far - near)) * (2.0 * np.pi / _SAMPLES))
