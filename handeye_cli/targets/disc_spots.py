"""Dark spots of an image that look like discs seen at some angle: filled ellipses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.two_by_two import determinants
from handeye_cli.records import FloatArray, GreyImage, IntArray

BoolArray = NDArray[np.bool_]
SingleArray = NDArray[np.float32]

_MOST = 5000
"""Outlines are measured up to this number, the longest ones."""
_ACROSS = 8
"""Places across the window at which the light around is told."""
_FAINT = (0.95, 4.0)
"""A dark pixel is below this share of the light around, and below it by so many levels."""
_CUT = 1.5
"""Pixels of the camera, or means of several, that a depth of 1 would cut off the rim of a spot."""
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
_SHARES = 1.0 / np.array([2.0, 6.0, 6.0, 12.0, 12.0, 24.0])[:, None]
"""Of the area and the integrals of x, y, xx, yy and xy in the terms of an outline's sides."""


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

    def scaled(self, factor: float) -> Spots:
        """Return the spots in the image of which factor x factor pixels make one of this one's."""
        if factor == 1.0:
            return self
        return Spots(self.centres * factor + (factor - 1) / 2, self.shapes * factor)

    @property
    def widths(self) -> FloatArray:
        """(n,) mean diameters, pixels."""
        return np.asarray(2.0 * np.sqrt(determinants(self.shapes)))


def find_spots(image: GreyImage, window: int, depth: float, *, enlarged: float = 1.0) -> Spots:
    """Return the dark spots that look like discs and do not touch the image's edge.

    Args:
        image: (height, width) image.
        window: Side of the square whose mean is the light around a pixel, pixels; discs are found
            up to about this width.
        depth: How far below that mean a dark pixel is at least, 0, or towards the darkest pixel of
            the square, 1; then narrow gaps between discs stay open.
        enlarged: Pixels of this image along one of the camera's, across which edges are blurred.
    """
    area, centres, spread = moments(_outlines(_dark(image, window, depth), _LONGEST * window))
    # the outline runs through the middles of the outermost pixels, half a pixel inside
    shapes = _ellipses(spread, 0.5 + _CUT * depth * enlarged)
    chosen = _elliptic(area, spread) & _inside(centres, shapes, image.shape)
    return Spots(centres[chosen], shapes[chosen])


def _dark(image: GreyImage, window: int, depth: float) -> GreyImage:
    """Return the mask of the pixels that are darker than what is around them."""
    # what is around changes slowly, so that some pixels across the window are enough to tell it
    rows, columns = image.shape
    step = max(1, window // _ACROSS)
    few = _some(image, step)
    size = (window // step | 1, window // step | 1)
    limit = cv2.blur(few, size)
    darkest = cv2.erode(few, np.ones(size, dtype=np.uint8)) if depth > 0.0 else limit
    share, levels = _FAINT
    limit = cv2.addWeighted(limit, share * (1.0 - depth), darkest, share * depth, -levels)
    limit = cv2.resize(limit, (columns, rows))
    # in place: a second image would push the first one out of the cache
    mask = cv2.compare(image, limit, cv2.CMP_LT, dst=limit)
    return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, _SPECK, dst=mask), dtype=np.uint8)


def _some(image: GreyImage, step: int) -> GreyImage:
    """Return an image resized to one pixel for step x step pixels, its edge perhaps left out."""
    rows, columns = image.shape
    if step % 2 and rows % step == 0 and columns % step == 0:
        # what resizing gives, without its reading of all pixels between
        return np.ascontiguousarray(image[step // 2 :: step, step // 2 :: step])
    few = cv2.resize(image, (max(1, columns // step), max(1, rows // step)))
    return np.asarray(few, dtype=np.uint8)


def _outlines(mask: GreyImage, longest: int) -> list[IntArray]:
    """Return the outlines, by the ends of rows, of a mask's parts and of their holes.

    They have at most `longest` corners, and of too many the longest are taken.
    """
    outlines: Any = cv2.findContoursLinkRuns(mask)[0]
    outlines = [each for each in outlines if _FEWEST <= len(each) <= longest]
    return outlines if len(outlines) <= _MOST else sorted(outlines, key=len)[-_MOST:]


def moments(outlines: list[IntArray]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return areas (n,), centroids (n, 2) and covariances (n, 2, 2) of what outlines enclose.

    Outlines are (k, 1, 2) arrays of 32-bit integers, as OpenCV gives them. Areas are negative for
    holes, whose outlines turn the other way.
    """
    if not outlines:
        return np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2, 2))
    lengths = np.fromiter(map(len, outlines), dtype=np.int64, count=len(outlines))
    starts = lengths.cumsum() - lengths
    path, origins = _paths(np.concatenate(outlines), starts, lengths)
    sums = np.add.reduceat(_terms(path), starts, axis=1) * _SHARES
    area = sums[0]
    means = sums[1:] / np.where(area == 0.0, np.inf, area)
    middle = means[:2]
    means[2:4] -= middle * middle
    spread = np.empty((len(area), 2, 2))
    spread[:, 0, 0], spread[:, 1, 1] = means[2], means[3]
    spread[:, 0, 1] = spread[:, 1, 0] = means[4] - middle[0] * middle[1]
    return area, origins + middle.T, spread


def _paths(
    corners: IntArray, starts: IntArray, lengths: IntArray
) -> tuple[SingleArray, NDArray[np.int32]]:
    """Return (2, m + 1) x and y of outlines from where each starts, and the (n, 2) starts.

    After the last corner of an outline comes the start of the next one, which is 0 as its own is.

    Args:
        corners: (m, 1, 2) pixels of all outlines, one after the other.
        starts: (n,) where the outlines start.
        lengths: (n,) their numbers of corners.
    """
    # x and y as one number: rows are chosen and repeated one by one, numbers many at once
    origins = corners.view(np.int64).ravel()[starts]
    path = np.zeros((2, len(corners) + 1), dtype=np.float32)
    path[:, :-1] = (corners[:, 0] - np.repeat(origins, lengths).view(np.int32).reshape(-1, 2)).T
    return path, origins.view(np.int32).reshape(-1, 2)


def _terms(path: SingleArray) -> SingleArray:
    """Return what the sides of outlines add to their moments by Green's theorem.

    Single precision has room for all digits of these whole numbers in spots up to 60 pixels wide,
    and for six of them in others.

    Args:
        path: (2, m + 1) x and y from the outline's start, to which the side of the last corner
            returns.

    Returns:
        (6, m) terms of the area and of the integrals of x, y, xx, yy and xy, of which `_SHARES` are
        to be taken.
    """
    here, there = path[:, :-1], path[:, 1:]
    terms = np.empty((6, here.shape[1]), dtype=np.float32)
    cross, firsts, squares, mixed = terms[0], terms[1:3], terms[3:5], terms[5]
    np.subtract(here[0] * there[1], here[1] * there[0], out=cross)
    both = here + there
    np.multiply(both, cross, out=firsts)
    np.subtract(both * both, here * there, out=squares)
    squares *= cross
    product = path[0] * path[1]
    np.multiply(both[0], both[1], out=mixed)
    mixed += product[:-1]
    mixed += product[1:]
    mixed *= cross
    return terms


def _elliptic(area: FloatArray, spread: FloatArray) -> BoolArray:
    """Say which areas are no specks, and filled ellipses by their (n, 2, 2) second moments."""
    determinant = np.maximum(determinants(spread), 1e-12)
    filled = area / np.sqrt(determinant)
    # for a ratio r of the axes, det / trace^2 is r^2 / (1 + r^2)^2
    trace = np.maximum(spread[:, 0, 0] + spread[:, 1, 1], 1e-6)
    slim = (_SLIMMEST / (1.0 + _SLIMMEST**2)) * trace
    least, most = (4.0 * np.pi * share for share in _FILLED)
    chosen = (area > _SMALLEST) & (filled > least) & (filled < most)
    return np.asarray(chosen & (determinant > slim * slim))


def _ellipses(spread: FloatArray, rim: float) -> FloatArray:
    """Return the symmetric maps from the unit circle to ellipses, with a rim around them.

    Args:
        spread: (n, 2, 2) second moments of the ellipses without the rim.
        rim: Width, pixels.
    """
    # twice the square root of a matrix of two rows is made of itself and the unit matrix
    root = np.sqrt(np.maximum(determinants(spread), 0.0))
    trace = spread[:, 0, 0] + spread[:, 1, 1]
    scale = 2.0 / np.sqrt(np.maximum(trace + 2.0 * root, 1e-12))
    shapes = spread * scale[:, None, None]
    root *= scale
    root += rim
    shapes[:, 0, 0] += root
    shapes[:, 1, 1] += root
    return shapes


def _inside(centres: FloatArray, shapes: FloatArray, size: tuple[int, ...]) -> BoolArray:
    reach = np.hypot(shapes[..., 0], shapes[..., 1])
    inside = (centres > reach) & (centres + reach < [size[1] - 1.0, size[0] - 1.0])
    return np.asarray(inside[:, 0] & inside[:, 1])
