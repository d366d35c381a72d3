"""Chances of sums of squares in closed form, which an even number of squares has."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_GRID = np.linspace(0.0, 60.0, 6001)


def chance_of_squares(
    squares: FloatArray | float, count: int, freedom: FloatArray | float = np.inf
) -> FloatArray:
    """Return the probability of a sum of squares as large as this, or larger.

    For even counts the tails of chi-square and F are finite sums (Abramowitz and Stegun, 26.4.4
    and 26.6.4).

    Args:
        squares: (...) sums of squares, weighted with their covariance.
        count: How many independent squares each sums up, an even number.
        freedom: (...) degrees of freedom with which the covariance's scale was estimated; infinite
            when it is known.

    Raises:
        ValueError: An odd count.
    """
    if count % 2:
        raise ValueError(f"expected an even number of squares, found {count}")
    squares, freedom = np.broadcast_arrays(np.asarray(squares, float), np.asarray(freedom, float))
    known = np.isinf(freedom)
    half = 0.5 * np.where(known, 1.0, freedom)
    over = squares / (2.0 * half)
    ratio = np.where(known, 0.5 * squares, over / (1.0 + over))
    decay = np.where(known, -0.5 * squares, -half * np.log1p(over))
    term, total = np.ones(squares.shape), np.ones(squares.shape)
    for j in range(count // 2 - 1):
        term = term * ratio * np.where(known, 1.0, half + j) / (j + 1)
        total = total + term
    return np.asarray(np.exp(decay) * total)


def trimmed_variance(fraction: float, count: int) -> float:
    """Return the variance of normal `count`-vectors of which only the shortest part is kept.

    Args:
        fraction: The part that is kept, above 0 and up to 1.
        count: Their even number of components, each of unit variance.

    Returns:
        The mean square of a component (Croux and Haesbroeck 1999), 1 where all are kept.
    """
    if fraction >= 1.0:
        return 1.0
    kept = 1.0 - chance_of_squares(_GRID, count)
    largest = np.interp(fraction, kept, _GRID)
    return float(1.0 - chance_of_squares(largest, count + 2)) / fraction
