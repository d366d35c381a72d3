"""Dark spots of an image that look like discs seen at some angle: filled ellipses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye_cli.records import FloatArray, GreyImage, IntArray

BoolArray = NDArray[np.bool_]

_MOST = 5000
"""Outlines are measured up to this number, the longest ones."""
_CUT = 1.5
"""Pixels that a depth of 1 would cut off the rim of a spot."""
_FAINT = (0.95, 4.0)
"""A dark pixel is below this share of the light around, and below it by so many levels."""
_FEWEST = 6
"""Corners of the outline of the smallest spot."""
_LONGEST = 6
"""Corners of the outline of a disc as wide as the window, at most, in pixels of that width."""
_SMALLEST = 5.0
"""Pixels within the outline of the smallest spot, which runs through its outermost pixels."""
_SPECK = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
"""What is smaller is no spot; there are thousands of it in a texture."""
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
    area, centres, spread = moments(_outlines(_dark(image, window, depth), _LONGEST * window))
    chosen = (area > _SMALLEST) & _elliptic(area, spread)
    centres, spread = centres[chosen], spread[chosen]
    # the outline runs through the middles of the outermost pixels, half a pixel inside
    shapes = 2.0 * _square_root(spread) + (0.5 + _CUT * depth) * np.eye(2)
    chosen = _inside(centres, shapes, image.shape)
    return Spots(centres[chosen], shapes[chosen])


def determinants(matrices: FloatArray) -> FloatArray:
    """Return the (...) determinants of (..., 2, 2) matrices, faster than by factorising them."""
    product = matrices[..., 0, 0] * matrices[..., 1, 1]
    return np.asarray(product - matrices[..., 0, 1] * matrices[..., 1, 0])


def mapped_back(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return the (..., 2) vectors that (..., 2, 2) matrices map to the given ones.

    By Cramer's rule, which takes a tenth of the time of factorising each matrix.
    """
    x, y = vectors[..., 0], vectors[..., 1]
    solved = np.empty(np.broadcast_shapes(matrices.shape[:-1], vectors.shape))
    solved[..., 0] = matrices[..., 1, 1] * x - matrices[..., 0, 1] * y
    solved[..., 1] = matrices[..., 0, 0] * y - matrices[..., 1, 0] * x
    solved /= determinants(matrices)[..., None]
    return solved


def _dark(image: GreyImage, window: int, depth: float) -> GreyImage:
    """Return the mask of the pixels that are darker than what is around them."""
    smooth = cv2.GaussianBlur(image, (3, 3), 0.7)
    # what is around changes slowly, so that every second pixel is enough to tell it
    rows, columns = image.shape
    half = cv2.resize(smooth, (max(1, columns // 2), max(1, rows // 2)))
    size = (window // 2 | 1, window // 2 | 1)
    limit = cv2.blur(half, size)
    darkest = cv2.erode(half, np.ones(size, dtype=np.uint8)) if depth > 0.0 else limit
    share, levels = _FAINT
    limit = cv2.addWeighted(limit, share * (1.0 - depth), darkest, share * depth, -levels)
    mask = cv2.compare(smooth, cv2.resize(limit, (columns, rows)), cv2.CMP_LT)
    return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, _SPECK), dtype=np.uint8)


def _outlines(mask: GreyImage, longest: int) -> list[IntArray]:
    """Return the outlines, as few corners, of a mask's parts and of their holes.

    They have at most `longest` corners, and of too many the longest are taken.
    """
    outlines: Any = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_SIMPLE)[0]
    outlines = [each for each in outlines if _FEWEST <= len(each) <= longest]
    return outlines if len(outlines) <= _MOST else sorted(outlines, key=len)[-_MOST:]


def moments(outlines: list[IntArray]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return areas (n,), centroids (n, 2) and covariances (n, 2, 2) of what outlines enclose.

    Areas are negative for holes, whose outlines turn the other way.
    """
    if not outlines:
        return np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2, 2))
    lengths = np.fromiter(map(len, outlines), dtype=np.int64, count=len(outlines))
    starts = np.cumsum(lengths) - lengths
    points = np.concatenate(outlines)[:, 0].T.astype(np.float64)
    origins = points[:, starts]
    x, y = points - np.repeat(origins, lengths, axis=1)
    u, v = np.roll(x, -1), np.roll(y, -1)
    # each outline starts at its own origin and returns to it
    u[starts - 1] = v[starts - 1] = 0.0
    cross = x * v - u * y
    p, q = x + u, y + v
    # sums over the triangles from the origin to each side, by Green's theorem
    terms = np.stack([cross, p * cross, q * cross,
                      (p * p - x * u) * cross, (p * q + x * y + u * v) * cross,
                      (q * q - y * v) * cross])  # fmt: skip
    scale = np.array([[2.0], [6.0], [6.0], [12.0], [24.0], [12.0]])
    area, *rest = np.add.reduceat(terms, starts, axis=1) / scale
    mx, my, xx, xy, yy = np.stack(rest) / np.where(area == 0.0, np.inf, area)
    spread = np.stack([xx - mx * mx, xy - mx * my, xy - mx * my, yy - my * my], axis=-1)
    # rows grow downwards, in which sense OpenCV turns around what is dark
    return -area, (origins + np.stack([mx, my])).T, spread.reshape(-1, 2, 2)


def _elliptic(area: FloatArray, spread: FloatArray) -> BoolArray:
    determinant = np.maximum(determinants(spread), 1e-12)
    filled = area / (4.0 * np.pi * np.sqrt(determinant))
    # for a ratio r of the axes, det / trace^2 is r^2 / (1 + r^2)^2
    slim = determinant / np.maximum(spread[:, 0, 0] + spread[:, 1, 1], 1e-6) ** 2
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
    trace = (matrices[:, 0, 0] + matrices[:, 1, 1])[:, None, None]
    return np.asarray((matrices + root * np.eye(2)) / np.sqrt(np.maximum(trace + 2 * root, 1e-12)))
