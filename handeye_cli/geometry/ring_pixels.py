"""The pixels along closed outlines that are nearly ellipses, row by row, without a mask."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
SingleArray = NDArray[np.float32]
IntArray = NDArray[np.int64]

_INSIDE = 0.7
"""Share of an outline's short half axis that a band takes to the inside, at most."""


def ring_pixels(
    rings: FloatArray, size: tuple[int, ...], band: float, *, every: int = 1
) -> tuple[IntArray, IntArray, IntArray]:
    """Select the pixels within a band around outlines.

    Args:
        rings: (n, k, 2) points of the outlines in the image, k even and evenly around.
        size: Height and width of the image.
        band: Half of the band's width, pixels.
        every: Every so many pixels are taken.

    Returns:
        Columns and rows of the pixels, one outline after the other, and (n,) their numbers.
    """
    middle = np.rint(rings.mean(axis=1)).astype(np.int64)
    here = rings - middle[:, None]
    along = np.roll(here, -1, axis=1) - np.roll(here, 1, axis=1)
    normal = np.stack([along[..., 1], -along[..., 0]], axis=-1)
    normal /= np.sqrt(np.sum(normal**2, axis=-1, keepdims=True))
    normal *= np.sign(np.sum(normal * here, axis=(1, 2)))[:, None, None]
    across = here - np.roll(here, here.shape[1] // 2, axis=1)
    short = np.sqrt(np.min(np.sum(across**2, axis=-1), axis=1)) / 2.0
    inside = np.minimum(band, _INSIDE * short)[:, None, None]
    low, high = np.floor(here.min(axis=(0, 1)) - band), np.ceil(here.max(axis=(0, 1)) + band)
    rows = np.arange(int(low[1]), int(high[1]) + 1)
    first, last = _spans(here + band * normal, rows)
    hollow_first, hollow_last = _spans(here - inside * normal, rows)
    hollow = hollow_first <= hollow_last
    starts = np.stack([first, np.where(hollow, hollow_last, last) + 1], axis=2)
    ends = np.stack([np.where(hollow, hollow_first - 1, last), last], axis=2)
    return _taken(_Runs(starts, ends, rows, middle), size, every)


@dataclass(frozen=True)
class _Runs:
    """Runs of pixels in the rows around outlines, relative to (n, 2) middles.

    Attributes:
        starts: (n, r, 2) first columns.
        ends: (n, r, 2) last columns; a run that ends before it starts is none.
        rows: (r,) rows.
        middle: (n, 2) whole pixels.
    """

    starts: IntArray
    ends: IntArray
    rows: IntArray
    middle: IntArray


def _spans(rings: FloatArray, rows: IntArray) -> tuple[IntArray, IntArray]:
    """Return the (n, r) first and last columns inside of ellipses at rows; 1 and 0 for none."""
    extent = np.max(np.abs(rings), axis=(1, 2))[:, None]
    x, y = rings[..., 0] / extent, rings[..., 1] / extent
    terms = np.stack([x, y, x * x, x * y, y * y], axis=1)
    right = np.sum(terms, axis=2)[..., None]
    conic = np.linalg.solve(terms @ np.swapaxes(terms, 1, 2), right)[..., 0]
    v = rows / extent
    a, b = conic[:, 2, None], 0.5 * (conic[:, 0, None] + conic[:, 3, None] * v)
    c = v * (conic[:, 1, None] + conic[:, 4, None] * v) - 1.0
    square = b * b - a * c
    root = np.sqrt(np.maximum(square, 0.0))
    first = np.ceil((-b - root) / a * extent).astype(np.int64)
    last = np.floor((-b + root) / a * extent).astype(np.int64)
    return np.where(square > 0.0, first, 1), np.where(square > 0.0, last, 0)


def _taken(runs: _Runs, size: tuple[int, ...], every: int) -> tuple[IntArray, IntArray, IntArray]:
    """Return the pixels of runs that are in an image of a height and width."""
    height, width = size[:2]
    across, down = runs.middle[:, :1], runs.middle[:, 1:] + runs.rows
    first = np.maximum(runs.starts + across[..., None], 0)
    last = np.minimum(runs.ends + across[..., None], width - 1)
    seen = ((down >= 0) & (down < height))[..., None]
    length = np.where(seen, np.maximum(last - first + 1, 0), 0)
    count = length.sum(axis=(1, 2))
    length = length.ravel()
    offset = first.ravel() - (np.cumsum(length) - length)
    column = np.repeat(offset, length) + np.arange(int(count.sum()))
    row = np.repeat(np.repeat(down.ravel(), 2), length)
    if every > 1:
        column, row = column[::every], row[::every]
        count = np.diff(-(-np.cumsum(count) // every), prepend=0)
    return column, row, count


class Padding:
    """Puts what belongs to n outlines, one after the other, into rows of one length."""

    def __init__(self, count: IntArray) -> None:
        """Take the (n,) numbers of what belongs to each."""
        self._held = np.arange(max(int(count.max()), 1)) < count[:, None]
        self._first = np.minimum(np.cumsum(count) - count, max(int(count.sum()) - 1, 0))

    @property
    def weight(self) -> SingleArray:
        """(n, m) 1, and 0 for the padding."""
        return self._held.astype(np.float32)

    def rows(self, values: SingleArray) -> SingleArray:
        """Return (n, m) values, each row filled up with its first."""
        out = np.repeat(values[self._first, None], self._held.shape[1], axis=1)
        out[self._held] = values
        return out
