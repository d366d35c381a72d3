"""Small subsets of stations: all there are, or a fixed random choice of them."""

from __future__ import annotations

from itertools import combinations
from math import comb

import numpy as np
from numpy.typing import NDArray


def subsets(count: int, size: int, most: int) -> NDArray[np.int64]:
    """Return subsets of `count` things, the same ones on every call.

    Args:
        count: How many things there are, at least `size`.
        size: How many are in a subset.
        most: Where there are more subsets than this, about as many are chosen at random.

    Returns:
        (m, size) different indices in each row.
    """
    if comb(count, size) <= most:
        return np.array(list(combinations(range(count), size)))
    # not NumPy's generators, which take far longer to load than these few numbers to draw
    from random import Random

    draw = Random(0).random
    drawn = np.array([[int(draw() * count) for _ in range(size)] for _ in range(2 * most)])
    ordered = np.sort(drawn, axis=1)
    different = np.all(np.diff(ordered, axis=1) > 0, axis=1)
    return ordered[different][:most]
