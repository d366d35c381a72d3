"""Where on a lattice of discs or corners that were seen the declared layout of a target lies."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye_cli.records import IntArray

SingleArray = NDArray[np.float32]

_MOST_POINTS = 50_000
"""Points of the positions in one turn that are returned: a few places fit a large layout in as many
ways as it has points."""
_QUARTER = np.array([[0, -1], [1, 0]])


def best_places(layout: IntArray, places: IntArray) -> tuple[list[IntArray], int]:
    """Return where a layout covers the most places.

    Args:
        layout: (n, 2) whole-numbered places of the layout's points.
        places: (m, 2) places of what was seen, in axes of the same handedness.

    Returns:
        (n, 2) places of the points, for each position of the layout with the largest number of
        places, quarter turns included unless they cover the same ones; and that number. Of very
        many positions of a large layout some are returned, two at least.
    """
    turns = _turns(np.ascontiguousarray(layout, dtype=np.int64).tobytes())
    # mostly what was seen is the layout itself
    first = places.min(axis=0)
    same = turns.get(_key(_mask(places - first)))
    if same is not None:
        return [same.places + first], len(layout)
    best: list[IntArray] = []
    most = 0
    for turned in turns.values():
        covered, first = _slid(turned.mask, places)
        if covered.max() > most:
            best, most = [], int(covered.max())
        corners = _some(np.argwhere(covered == most), _MOST_POINTS // len(layout))
        best += [turned.places + first + corner for corner in corners]
    return best, most


def _some(rows: IntArray, most: int) -> IntArray:
    """Return some of many rows, spread evenly with the first and the last among them."""
    count = max(2, most)
    if len(rows) <= count:
        return rows
    return rows[np.linspace(0, len(rows) - 1, count).astype(np.int64)]


class _Turned(NamedTuple):
    """A layout in one of its turns: the places of its points, from (0, 0) on, and a map of them."""

    places: IntArray
    mask: SingleArray


_Key = tuple[tuple[int, ...], bytes]


@lru_cache(maxsize=64)
def _turns(layout: bytes) -> dict[_Key, _Turned]:
    """Return a layout in quarter turns, each set of places once; every image asks for them."""
    turned = np.frombuffer(layout, np.int64).reshape(-1, 2)
    found: dict[_Key, _Turned] = {}
    for _ in range(4):
        turned = turned - turned.min(axis=0)
        mask = _mask(turned)
        found.setdefault(_key(mask), _Turned(turned, mask))
        turned = turned @ _QUARTER.T
    return found


def _mask(places: IntArray) -> SingleArray:
    """Return a map that is 1 at (n, 2) places, from (0, 0) to the last of them."""
    mask = np.zeros(places.max(axis=0) + 1, dtype=np.float32)
    mask[tuple(places.T)] = 1.0
    return mask


def _key(mask: SingleArray) -> _Key:
    return mask.shape, mask.tobytes()


def _slid(mask: SingleArray, places: IntArray) -> tuple[SingleArray, IntArray]:
    """Return how many places a layout covers, by where its corner is laid, and the first corner."""
    size, first = np.array(mask.shape), places.min(axis=0)
    around = np.zeros(places.max(axis=0) - first + 2 * size - 1, dtype=np.float32)
    around[tuple((places - first + size - 1).T)] = 1.0
    covered = np.rint(cv2.matchTemplate(around, mask, cv2.TM_CCORR))
    return covered, first - size + 1
