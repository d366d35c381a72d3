"""What is wrong with an image in which nothing was found, whatever was sought in it."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from handeye_cli.records import FloatArray, GreyImage

_FLAT = 15
"""Grey levels that an image without anything to see spans at most."""
_OUTLIERS = 20
"""Darkest and lightest pixels that may be faults of the sensor."""
_DARK, _LIGHT = 30, 240
"""Grey levels that an image without light, or with too much of it, does not leave."""

_SOFT = 8.0
"""Pixels that the sharpest edge takes in an image that is blurred."""
_MOVED = 2.5
"""Ratio of the widths of edges in two directions that tells a motion."""
_DIRECTIONS = 8
_SHARPEST = 30
"""Pixels of edges of which the last one counts as the sharpest, past noise."""
_AROUND = 33
"""Side of the square, in pixels, whose levels an edge is measured against."""
_LOOKED_AT = 400_000
"""Pixels at which edges are measured, about."""

_SPECK_BLUR = 0.6
_FAINT = 10.0
"""Grey levels by which a speck differs from what is around it at least."""
_CLOSE = 10.0
"""Pixels between the middles of specks that lie close together."""
_EVEN = 0.85
"""Share of specks at an even distance that chance does not give."""
_MOST_SPECKS = 20_000


def fault(grey: GreyImage, *, all_around: bool = False) -> str | None:
    """Return why nothing can be found in an image, for people, or None when it is not to blame.

    Args:
        grey: (height, width) image.
        all_around: Whether it shows something that has edges in all directions, as discs have, so
            that edges which are soft in one direction only tell of a motion.
    """
    return _flat(grey) or _blurred(grey, all_around)


def even_specks(grey: GreyImage) -> tuple[int, float]:
    """Return how many dark specks are evenly spaced, as tiny discs are, and how far apart.

    Args:
        grey: (height, width) image.

    Returns:
        Their number, 0 when they are not even, and the distance of neighbours in pixels.
    """
    smooth = cv2.GaussianBlur(grey, (0, 0), _SPECK_BLUR)
    hollow = cv2.morphologyEx(smooth, cv2.MORPH_BLACKHAT, np.ones((7, 7), dtype=np.uint8))
    least = max(_FAINT, 0.5 * float(hollow.max()))
    peaks = (hollow == cv2.dilate(hollow, np.ones((3, 3), dtype=np.uint8))) & (hollow >= least)
    places = cv2.connectedComponentsWithStats(peaks.astype(np.uint8))[3][1:]
    if not 4 <= len(places) <= _MOST_SPECKS:
        return 0, 0.0
    apart = KDTree(places).query(places, k=4)[0][:, 1:]
    # on a lattice even the third neighbour is as near as the first, at its corners nearly
    regular = (apart[:, 2] < 1.5 * apart[:, 0]) & (apart[:, 0] < _CLOSE)
    if not np.any(regular):
        return 0, 0.0
    step = float(np.median(apart[regular]))
    even = np.mean(np.abs(np.mean(apart[regular], axis=1) / step - 1.0) < 0.2)
    return (int(regular.sum()) if even > _EVEN else 0), step


def _flat(grey: GreyImage) -> str | None:
    """Say that there is nothing in an image, however small, that a disc could be."""
    smooth = cv2.GaussianBlur(grey, (0, 0), 1.0)
    levels = np.cumsum(cv2.calcHist([smooth], [0], None, [256], [0, 256]).astype(np.int64))
    few = min(_OUTLIERS, grey.size // 4)
    dark, light = np.searchsorted(levels, [few, grey.size - 1 - few], side="right").tolist()
    if light - dark >= _FLAT:
        return None
    found = f"the image has nothing but grey levels from {dark} to {light}"
    if light <= _DARK:
        return f"{found}, it is too dark"
    return f"{found}, it is overexposed" if dark >= _LIGHT else found


def _blurred(grey: GreyImage, all_around: bool) -> str | None:
    """Say that even the sharpest edge of an image is soft, in one direction at least."""
    sharpest = _sharpest_edges(grey)
    if sharpest is None:
        return None
    least, most = sharpest.min(), sharpest.max()
    if least > _SOFT:
        return f"the image is blurred, its sharpest edge is {least:.0f} px wide"
    if all_around and most > max(_SOFT, _MOVED * least):
        wide = f"{most:.0f} px wide across it and {least:.0f} px along"
        return f"the image is blurred in one direction, as by motion: edges are {wide}"
    return None


def _sharpest_edges(grey: GreyImage) -> FloatArray | None:
    """Return the widths of the sharpest edges of an image, or None when there are none.

    The width of an edge is the range of the levels around over the slope. What is faint beside the
    rest of the image is left out: its slope is the noise's.

    Args:
        grey: (height, width) image.

    Returns:
        (directions,) pixels, for each direction across an edge.
    """
    smooth = cv2.GaussianBlur(grey, (0, 0), 1.0)
    around = np.ones((_AROUND, _AROUND), dtype=np.uint8)
    levels = cv2.subtract(cv2.dilate(smooth, around), cv2.erode(smooth, around))
    contrast = np.asarray(levels, dtype=np.uint8)
    least = max(_FLAT, 0.5 * float(contrast.max()))
    # of a large image some of the pixels will do, in time and in memory
    step = math.ceil(math.sqrt(grey.size / _LOOKED_AT))
    contrast = contrast[::step, ::step]
    chosen = contrast >= least
    if np.sum(chosen) < _SHARPEST:
        return None
    slopes = [
        cv2.Sobel(smooth, cv2.CV_16S, *axis)[::step, ::step][chosen] for axis in ((1, 0), (0, 1))
    ]
    return _edge_widths(np.stack(slopes, axis=1) / np.float32(8.0), contrast[chosen])


def _edge_widths(slopes: NDArray[np.floating], contrast: NDArray[np.integer]) -> FloatArray:
    """Return the width of the sharpest edges in each of some directions across them.

    Args:
        slopes: (n, 2) derivatives to the right and down, grey levels per pixel.
        contrast: (n,) range of the levels around each pixel.

    Returns:
        (directions,) widths in pixels.
    """
    angles = np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    normals = np.stack([np.cos(angles), np.sin(angles)]).astype(slopes.dtype)
    inverse = np.abs(slopes @ normals) / contrast[:, None].astype(slopes.dtype)
    sharp = np.partition(inverse, len(inverse) - _SHARPEST, axis=0)[len(inverse) - _SHARPEST]
    return np.asarray(1.0 / np.maximum(sharp, 1e-3), dtype=np.float64)
