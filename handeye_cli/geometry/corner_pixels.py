"""The pixels around the corners of a chessboard, and how far they are from the edges there.

Perspective leaves edges straight and a lens bends them by very little within a window. So the
distance of a pixel from an edge is that from the edge's tangent at the corner, less what the edge's
curvature takes off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.blurred_edge import SingleArray
from handeye_cli.geometry.camera import PlateToPixel
from handeye_cli.geometry.sensor_limits import BLACK, WHITE

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

_REACH = 0.45
"""Radius of the windows in squares: at 0.5 the blur of the next corners would be seen."""
_WIDEST = 20.0
"""Largest radius of a window, pixels: on a board that is not flat, long edges are bent."""


@dataclass(frozen=True)
class Crossings:
    """The two edges that cross in each corner, as the image shows them.

    Attributes:
        start: (n, 2) pixels where the corners are assumed.
        normals: (n, 2, 2) unit normals, in rows, of the edges x = 0 and y = 0, to larger x and y.
        tangents: (n, 2, 2) unit vectors along these edges, in rows.
        curvatures: (n, 2) of these edges towards their normals, 1 / pixels.
        to_board: (n, 2, 2) from pixels beside the corner to the board, in squares.
        radius: (n,) of the windows, in squares.
    """

    start: FloatArray
    normals: FloatArray
    tangents: FloatArray
    curvatures: FloatArray
    to_board: FloatArray
    radius: FloatArray

    @property
    def shear(self) -> SingleArray:
        """(n,) cosine of the angle between the two normals."""
        cosine = np.sum(self.normals[:, 0] * self.normals[:, 1], axis=-1)
        return np.asarray(cosine, dtype=np.float32)


@dataclass(frozen=True)
class CornerPixels:
    """The m pixels at most near the edges at each of n corners; components come before pixels.

    Attributes:
        grey: (n, m) grey levels.
        weight: (n, m) 1 for a pixel that takes part, else 0.
        middle: (n, 2) of the windows in the image, in half widths of a window.
        offset: (n, 2, m) from the window's middle, in half widths.
        distance: (n, 2, m) from the edges x = 0 and y = 0, pixels, with the signs of x and y.
        place: (n, 2, m) on the board from the corner, squares.
    """

    grey: SingleArray
    weight: SingleArray
    middle: FloatArray
    offset: SingleArray
    distance: SingleArray
    place: SingleArray

    @cached_property
    def at_limits(self) -> IntArray:
        """(k,) pixels of weight that are black or white, counted row by row."""
        grey, seen = self.grey.ravel(), self.weight.ravel() > 0.0
        return np.flatnonzero(((grey <= BLACK) | (grey >= WHITE)) & seen)

    @property
    def clipped(self) -> bool:
        """Whether light beyond the limits of the sensor may be among them."""
        return len(self.at_limits) > 0

    def thinned(self, step: int) -> CornerPixels:
        """Return every `step`-th pixel."""
        arrays = (self.grey, self.weight, self.offset, self.distance, self.place)
        grey, weight, *rest = (np.ascontiguousarray(array[..., ::step]) for array in arrays)
        return CornerPixels(grey, weight, self.middle, *rest)

    def within(self, band: float, shift: FloatArray) -> CornerPixels:
        """Return the pixels up to `band` px from edges shifted by (n, 2) along their normals."""
        away = np.abs(self.distance - shift[..., None].astype(np.float32))
        return replace(self, weight=self.weight * (np.min(away, axis=1) < band))

    def core(self, reach: float) -> int:
        """Return how many pixels, the first ones, hold all that are nearer to both edges."""
        near = np.any(np.max(np.abs(self.distance), axis=1) < reach, axis=0)
        return int(np.flatnonzero(near)[-1]) + 1 if np.any(near) else 0

    def beside_prints(self, seen: Crossings, gap: float, clear: float) -> CornerPixels:
        """Return the pixels without those that what is printed in the light squares may darken.

        Args:
            seen: The edges.
            gap: Width of the free margin of the light squares, squares.
            clear: How far the print's blur reaches, pixels.
        """
        same = np.sign(self.place[:, 0] * self.place[:, 1])
        count = np.maximum(np.sum(self.weight, axis=1), 1.0)
        level = np.sum(self.grey * self.weight, axis=1) / count
        dark = np.sign(np.sum((level[:, None] - self.grey) * self.weight * same, axis=1))
        free = gap - clear * np.linalg.norm(seen.to_board, axis=-1)
        deep = np.all(np.abs(self.place) > free[..., None], axis=1)
        printed = deep & (same * dark[:, None] < 0)
        return replace(self, weight=self.weight * ~printed)


def crossings(
    corners: FloatArray, square: float, to_pixel: PlateToPixel, start: FloatArray
) -> Crossings:
    """Return the edges at corners whose map is moved so that they are imaged at `start`.

    Args:
        corners: (n, 2) corners on the board, metres.
        square: Side of a square, metres.
        to_pixel: Map of (..., 2) board points to (..., 2) pixels.
        start: (n, 2) pixels.
    """
    step = 0.5 * _REACH * square * np.array([[0, -1], [0, 1], [-1, 0], [1, 0]])
    around = to_pixel(corners[:, None] + step) - to_pixel(corners)[:, None]
    back, ahead = around[:, [0, 2]], around[:, [1, 3]]
    a, b = (np.linalg.norm(each, axis=-1, keepdims=True) for each in (back, ahead))
    # The parabola through three points, by its length.
    tangents = (ahead * a * a - back * b * b) / (a * b * (a + b))
    bend = 2.0 * (ahead * a + back * b) / (a * b * (a + b))
    jacobian = np.swapaxes((ahead - back)[:, ::-1] / _REACH, 1, 2)
    to_board = np.asarray(np.linalg.inv(jacobian), dtype=np.float64)
    normals = np.stack([-tangents[..., 1], tangents[..., 0]], axis=-1)
    normals *= np.sign(np.sum(normals * to_board, axis=-1, keepdims=True))
    longest = np.linalg.norm(jacobian, axis=(1, 2))
    return Crossings(
        start=start,
        normals=normals,
        tangents=tangents,
        curvatures=np.sum(bend * normals, axis=-1),
        to_board=to_board,
        radius=np.minimum(_REACH, _WIDEST / longest),
    )


def corner_pixels(image: NDArray[np.uint8], seen: Crossings, band: float) -> CornerPixels:
    """Return the pixels in a band around the edges, those near the corners first.

    Args:
        image: (height, width) grey image.
        seen: The edges.
        band: Half the width of the band, pixels.
    """
    extent = seen.radius[:, None] * np.linalg.norm(np.linalg.inv(seen.to_board), axis=-1)
    half = math.ceil(float(np.max(extent)))
    window = _window(half)
    middle = np.rint(seen.start)
    beside = middle - seen.start
    away = np.min(np.abs(_linear(seen.normals, window, beside)), axis=1)
    place = _linear(seen.to_board, window, beside)
    radius = seen.radius[:, None].astype(np.float32)
    chosen, weight = _packed((away < band) & (np.sum(place * place, axis=1) < radius * radius))
    offset = np.moveaxis(window[:, chosen], 0, 1)
    column, row = np.moveaxis((middle[:, :, None] + offset).astype(np.int64), 1, 0)
    inside = (row >= 0) & (row < image.shape[0]) & (column >= 0) & (column < image.shape[1])
    along = _linear(seen.tangents, offset, beside)
    sag = 0.5 * seen.curvatures[..., None].astype(np.float32) * along * along
    return CornerPixels(
        grey=image[np.where(inside, row, 0), np.where(inside, column, 0)].astype(np.float32),
        weight=weight * inside,
        middle=middle / half,
        offset=offset / np.float32(half),
        distance=_linear(seen.normals, offset, beside) - sag,
        place=np.take_along_axis(place, chosen[:, None], axis=2),
    )


def _window(half: int) -> SingleArray:
    """Return the (2, k) pixels of a round window, from its middle outwards."""
    line = np.arange(-half, half + 1, dtype=np.float32)
    u, v = (each.ravel() for each in np.meshgrid(line, line))
    squared = u * u + v * v
    order = np.argsort(squared, kind="stable")[: int(np.sum(squared <= (half + 1) ** 2))]
    return np.stack([u[order], v[order]])


def _linear(matrix: FloatArray, offset: SingleArray, beside: FloatArray) -> SingleArray:
    """Return the (n, 2, k) products of (n, 2, 2) matrices with pixels beside the corners."""
    return matrix.astype(np.float32) @ offset + (matrix @ beside[..., None]).astype(np.float32)


def _packed(mask: BoolArray) -> tuple[IntArray, SingleArray]:
    """Return (n, m) indices of each row's true entries, padded with 0, and weights 1 or 0."""
    row, column = np.nonzero(mask)
    count = np.bincount(row, minlength=len(mask))
    place = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    chosen = np.zeros((len(mask), max(int(count.max()), 1)), dtype=np.int64)
    weight = np.zeros(chosen.shape, dtype=np.float32)
    chosen[row, place], weight[row, place] = column, 1.0
    return chosen, weight
