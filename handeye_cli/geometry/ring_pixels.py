"""The pixels along ellipses, row by row, without a mask."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
SingleArray = NDArray[np.float32]
IntArray = NDArray[np.int64]

INSIDE = 0.7
"""Share of an ellipse's short half axis that a band takes to the inside, at most."""


@dataclass(frozen=True)
class Ellipses:
    """The n ellipses `middle + M e`, with unit vectors e.

    Attributes:
        middle: (n, 2) pixels.
        square: (3, n) elements uu, uv, vv of M M'.
        half_axes: (2, n) half axes, the longer ones first.
    """

    middle: FloatArray
    square: FloatArray
    half_axes: FloatArray

    @classmethod
    def of(cls, middle: FloatArray, square: FloatArray) -> Ellipses:
        """Return the ellipses with these middles and squares."""
        uu, uv, vv = square
        mean, apart = (uu + vv) / 2.0, np.hypot((uu - vv) / 2.0, uv)
        return cls(middle, square, np.sqrt(np.array([mean + apart, mean - apart])))

    def grown(self, by: FloatArray) -> FloatArray:
        """Return the (3, ..., n) squares for half axes that are longer by (..., n)."""
        product, total = self.half_axes.prod(axis=0), self.half_axes.sum(axis=0)
        even = np.array([1.0, 0.0, 1.0])[:, None]
        root = (self.square + product * even) / total
        shape = (3,) + (1,) * (by.ndim - 1) + (-1,)
        root, even = root.reshape(shape), even.reshape(shape)
        return np.asarray(self.square.reshape(shape) + 2.0 * by * root + by * by * even)


def ring_pixels(
    ellipses: Ellipses,
    origin: FloatArray,
    size: tuple[int, ...],
    band: float,
    *,
    hollow: bool = True,
) -> tuple[SingleArray, SingleArray, SingleArray]:
    """Select the pixels within a band around ellipses.

    Args:
        ellipses: The ellipses, their middles from the origins.
        origin: (n, 2) whole pixels.
        size: Height and width of the image.
        band: Half of the band's width, pixels.
        hollow: Whether the middles of large ellipses are left out, else all inside is taken.

    Returns:
        (n, m) columns and rows of the pixels, from the origins, and their weights: 1, or 0 for what
        fills up the shorter lists, one pixel at the ellipse again and again.
    """
    inside = np.minimum(band, INSIDE * ellipses.half_axes[1])
    squares = ellipses.grown(np.stack([np.full_like(inside, band), -inside]))
    reach = int(np.sqrt(squares[2, 0].max())) + 2
    rows = np.arange(-reach, reach + 1.0)
    (first, hollow_first), (last, hollow_last) = _spans(squares, ellipses.middle, rows)
    left, top = -origin.T[..., None]
    first = np.maximum(first, left)
    end = np.minimum(last, left + (size[1] - 1)) + 1.0
    if not hollow:
        hollow_first, hollow_last = first, first - 1.0
    hollow_end = np.minimum(np.maximum(hollow_last + 1.0, first), end)
    hollow_first = np.minimum(np.maximum(hollow_first, first), end)
    starts = np.concatenate([first, hollow_end], axis=1)
    length = np.maximum(np.concatenate([hollow_first - first, end - hollow_end], axis=1), 0.0)
    if -reach < top.max() or reach >= top.min() + size[0]:
        length *= np.tile((rows >= top) & (rows < top + size[0]), 2)
    return _filled(starts, length.astype(np.int64), rows)


def _spans(
    squares: FloatArray, middle: FloatArray, rows: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the (..., n, r) first and last columns inside of ellipses at rows.

    In a row beside an ellipse the last column is before the first, or the same.
    """
    uu, uv, vv = squares[..., None]
    down = rows - middle[:, 1:]
    line = middle[:, :1] + uv / vv * down
    half = np.sqrt(np.maximum(vv - down * down, 0.0))
    half *= np.sqrt(uu * vv - uv * uv) / vv
    return np.ceil(line - half), np.floor(line + half)


def _filled(
    starts: FloatArray, length: IntArray, rows: FloatArray
) -> tuple[SingleArray, SingleArray, SingleArray]:
    """Return the pixels of (n, 2 r) runs in rows, filled up as `ring_pixels` says."""
    count = length.sum(axis=1, keepdims=True)
    most = max(int(count.max()), 1)
    length = np.concatenate([length, most - count], axis=1).ravel()
    spare = starts[:, len(rows) // 2, None]
    starts = np.concatenate([starts, spare], axis=1).ravel() - (np.cumsum(length) - length)
    column = np.repeat(starts.astype(np.float32), length).reshape(-1, most)
    column += np.arange(column.size, dtype=np.float32).reshape(-1, most)
    downwards = np.concatenate([rows, rows, [0.0]]).astype(np.float32)
    downwards = np.broadcast_to(downwards, (len(count), len(downwards))).ravel()
    row = np.repeat(downwards, length).reshape(-1, most)
    held = np.arange(most) < count
    np.copyto(column, spare, where=~held, casting="same_kind")
    return column, row, held.astype(np.float32)
