"""Dark spots of an image that look like discs seen at some angle: filled ellipses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye_cli.records import FloatArray, GreyImage

BoolArray = NDArray[np.bool_]

_MOST = 3000
"""Outlines are measured up to this number, the longest ones."""
_CUT = 1.5
"""Pixels that a depth of 1 would cut off the rim of a spot."""
_FAINT = (0.95, 4.0)
"""A dark pixel is below this share of the light around, and below it by so many levels."""
_SHORTEST = 10
"""Pixels along the outline of the smallest spot."""
_SLIMMEST = 0.2
"""Smallest ratio of an ellipse's axes: a disc at a tilt of 78 degrees."""
_FILLED = (0.88, 1.08)
"""Area of a spot over that of the ellipse with its second moments, which is 1 for an ellipse."""


@dataclass(frozen=True)
class Spots:
    """Spots in an image, as the ellipses that have their moments.

    Attributes:
        centres: (n, 2) middles, pixels.
        shapes: (n, 2, 2) matrices that map the unit circle to an ellipse around its middle.
    """

    centres: FloatArray
    shapes: FloatArray

    def __len__(self) -> int:
        return len(self.centres)

    def scaled(self, factor: int) -> Spots:
        """Return the spots in the image whose blocks of factor x factor pixels were averaged."""
        return Spots(self.centres * factor + (factor - 1) / 2, self.shapes * factor)

    @property
    def widths(self) -> FloatArray:
        """(n,) mean diameters, pixels."""
        return np.asarray(2.0 * np.sqrt(determinants(self.shapes)))


def find_spots(image: GreyImage, window: int, depth: float) -> Spots:
    """Return the dark spots that look like discs and do not touch the image's edge.

    Args:
        image: (height, width) image.
        window: Side of the square whose mean is the light around a pixel, pixels; discs are found
            up to about this width.
        depth: How far below that mean a dark pixel is at least, 0, or towards the darkest pixel of
            the square, 1; then narrow gaps between discs stay open.
    """
    area, centres, spread = _moments(_outlines(_dark(image, window, depth)))
    # the outline runs through the middles of the outermost pixels, half a pixel inside
    shapes = 2.0 * _square_root(spread) + (0.5 + _CUT * depth) * np.eye(2)
    chosen = _elliptic(area, spread) & _inside(centres, shapes, image.shape)
    return Spots(centres[chosen], shapes[chosen])


def determinants(matrices: FloatArray) -> FloatArray:
    """Return the (...) determinants of (..., 2, 2) matrices, faster than by factorising them."""
    product = matrices[..., 0, 0] * matrices[..., 1, 1]
    return np.asarray(product - matrices[..., 0, 1] * matrices[..., 1, 0])


def _dark(image: GreyImage, window: int, depth: float) -> GreyImage:
    """Return the mask of the pixels that are darker than what is around them."""
    smooth = cv2.GaussianBlur(image, (3, 3), 0.7)
    limit = cv2.blur(image, (window, window))
    if depth > 0.0:
        darkest = cv2.erode(smooth, np.ones((window, window), dtype=np.uint8))
        limit = cv2.addWeighted(limit, 1.0 - depth, darkest, depth, 0.0)
    share, levels = _FAINT
    mask = cv2.compare(smooth, cv2.addWeighted(limit, share, limit, 0.0, -levels), cv2.CMP_LT)
    return np.asarray(mask, dtype=np.uint8)


def _outlines(mask: GreyImage) -> list[FloatArray]:
    """Return the outer outlines of a mask's parts, without the shortest."""
    found: Any = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    outlines, levels = found
    if levels is None:
        return []
    lengths = np.fromiter(map(len, outlines), dtype=np.int64, count=len(outlines))
    chosen = np.flatnonzero((lengths >= _SHORTEST) & (levels[0, :, 3] < 0))
    if len(chosen) > _MOST:
        chosen = chosen[np.argsort(-lengths[chosen], kind="stable")[:_MOST]]
    return [outlines[k] for k in chosen]


def _moments(outlines: list[FloatArray]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return areas (n,), centroids (n, 2) and covariances (n, 2, 2) of what outlines enclose."""
    if not outlines:
        return np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2, 2))
    lengths = np.fromiter(map(len, outlines), dtype=np.int64, count=len(outlines))
    starts = np.cumsum(lengths) - lengths
    points = np.concatenate(outlines)[:, 0].astype(np.float64)
    origins = points[starts]
    x, y = (points - np.repeat(origins, lengths, axis=0)).T
    after = np.arange(1, len(x) + 1)
    after[starts + lengths - 1] = starts
    u, v = x[after], y[after]
    cross = x * v - u * y
    # sums over the triangles from the origin to each side, by Green's theorem
    terms = np.stack([
        cross / 2, (x + u) * cross / 6, (y + v) * cross / 6,
        (x * x + x * u + u * u) * cross / 12,
        (2 * (x * y + u * v) + x * v + u * y) * cross / 24,
        (y * y + y * v + v * v) * cross / 12,
    ])  # fmt: skip
    sums = np.add.reduceat(terms, starts, axis=1)
    solid = np.abs(sums[0]) > 0.5
    area, *rest = sums[:, solid]
    mx, my, xx, xy, yy = np.stack(rest) / area
    spread = np.stack([xx - mx * mx, xy - mx * my, xy - mx * my, yy - my * my], axis=-1)
    return np.abs(area), origins[solid] + np.stack([mx, my], axis=-1), spread.reshape(-1, 2, 2)


def _elliptic(area: FloatArray, spread: FloatArray) -> BoolArray:
    determinant = np.maximum(determinants(spread), 1e-12)
    filled = area / (4.0 * np.pi * np.sqrt(determinant))
    # for a ratio r of the axes, det / trace^2 is r^2 / (1 + r^2)^2
    slim = determinant / np.trace(spread, axis1=1, axis2=2) ** 2
    limit = (_SLIMMEST / (1.0 + _SLIMMEST**2)) ** 2
    return np.asarray((filled > _FILLED[0]) & (filled < _FILLED[1]) & (slim > limit))


def _inside(centres: FloatArray, shapes: FloatArray, size: tuple[int, ...]) -> BoolArray:
    reach = np.linalg.norm(shapes, axis=2)
    limit = np.array(size[::-1]) - 0.5
    inside = (centres - reach > 0.0) & (centres + reach < limit - 0.5)
    return np.asarray(np.all(inside, axis=1))


def _square_root(matrices: FloatArray) -> FloatArray:
    """Return the symmetric square roots of (n, 2, 2) symmetric positive matrices."""
    root = np.sqrt(np.maximum(determinants(matrices), 0.0))[:, None, None]
    trace = np.trace(matrices, axis1=1, axis2=2)[:, None, None]
    return np.asarray((matrices + root * np.eye(2)) / np.sqrt(np.maximum(trace + 2 * root, 1e-12)))
