"""Interstation pairs: the paper's star drawing (its figure 6), for any number of stations."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray


def star_pairs(count: int) -> NDArray[np.int64]:
    """Return the pairs of the star drawing over stations in the order of the generator.

    An odd number of stations is joined by one closed star with the step (N - 1) / 2. An even one
    takes the step N / 2 - 1; where that leaves two separate stars (N = 6, 10, 14, ...), the pairs
    of opposite stations join them. Both keep every interstation angle near its largest.

    Args:
        count: Number of stations, at least 3.

    Returns:
        (m, 2) indices, the smaller first, sorted.

    Raises:
        ValueError: Fewer than three stations.
    """
    if count < 3:
        raise ValueError(f"a star needs at least 3 stations, found {count}")
    step = (count - 1) // 2
    first = np.arange(count)
    pairs = np.stack([first, (first + step) % count], axis=1)
    if math.gcd(step, count) > 1:
        half = np.arange(count // 2)
        pairs = np.concatenate([pairs, np.stack([half, half + count // 2], axis=1)])
    pairs = np.sort(pairs, axis=1)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def all_pairs(count: int) -> NDArray[np.int64]:
    """Return every pair (i, j), i < j, of `count` stations as (m, 2) indices."""
    return np.stack(np.triu_indices(count, 1), axis=1)
