"""Where on a lattice of spots the declared layout of discs lies."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye_cli.records import IntArray

SingleArray = NDArray[np.float32]

_QUARTER = np.array([[0, -1], [1, 0]])


def windows(layout: IntArray, places: IntArray) -> tuple[list[IntArray], int]:
    """Return where a layout covers the most spots.

    Args:
        layout: (n, 2) whole-numbered places of the layout's points.
        places: (m, 2) places of the spots, in axes of the same handedness.

    Returns:
        (n, 2) places of the points, for each position of the layout with the largest number of
        spots, quarter turns included unless they cover the same places; and that number.
    """
    best: list[IntArray] = []
    most = 0
    for turned in _turns(layout):
        covered, first = _slid(turned, places)
        if covered.max() > most:
            best, most = [], int(covered.max())
        best += [turned + first + corner for corner in np.argwhere(covered == most)]
    return best, most


def _turns(layout: IntArray) -> list[IntArray]:
    """Return the layout in quarter turns, from (0, 0) on, each set of places once."""
    turned, found, known = layout, [], set()
    for _ in range(4):
        turned = turned - turned.min(axis=0)
        key = np.sort(turned @ [turned.max() + 1, 1]).tobytes()
        if key not in known:
            known.add(key)
            found.append(turned)
        turned = turned @ _QUARTER.T
    return found


def _slid(layout: IntArray, places: IntArray) -> tuple[SingleArray, IntArray]:
    """Return how many places a layout covers, by where its corner is laid, and the first corner."""
    size = layout.max(axis=0) + 1
    mask = np.zeros(size, dtype=np.float32)
    mask[tuple(layout.T)] = 1.0
    first = places.min(axis=0)
    around = np.zeros(places.max(axis=0) - first + 2 * size - 1, dtype=np.float32)
    around[tuple((places - first + size - 1).T)] = 1.0
    covered = np.rint(cv2.matchTemplate(around, mask, cv2.TM_CCORR))
    return covered, first - size + 1
