"""Chances of what tests of hypotheses compare: chi-square, F, and ratios of quadratic forms.

Standard library only: whatever judges poses alone needs no more than numpy.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_MAX_TERMS = 10_000
_PRECISION = 1e-15
_TINY = 1e-300
_BISECTIONS = 200
_GRID = np.linspace(0.0, 60.0, 6001)
"""Sums of squares that a distribution is tabulated at."""
_AT_THE_MEAN = 1e-4
"""Signed root of the log-likelihood below which the saddlepoint formula divides rounding errors."""


def chi_square_tail(squares: float, count: float) -> float:
    """Return the probability that a chi-square exceeds a value.

    Args:
        squares: The value.
        count: Its degrees of freedom, positive; any real number.
    """
    return 1.0 if squares <= 0.0 else _gamma_parts(0.5 * count, 0.5 * squares)[1]


def chi_square_head(squares: float, count: float) -> float:
    """Return the probability that a chi-square stays below a value; see `chi_square_tail`."""
    return 0.0 if squares <= 0.0 else _gamma_parts(0.5 * count, 0.5 * squares)[0]


def f_tail(ratio: float, above: float, below: float) -> float:
    """Return the probability that Fisher's F exceeds a value.

    Args:
        ratio: The value.
        above: Degrees of freedom of the numerator.
        below: Degrees of freedom of the denominator; infinite where its scale is known.
    """
    if ratio <= 0.0:
        return 1.0
    if math.isinf(below):
        return chi_square_tail(above * ratio, above)
    whole = below + above * ratio
    return _beta(below / whole, above * ratio / whole, 0.5 * below, 0.5 * above)


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


def normal_tail(value: float) -> float:
    """Return the probability that a standard normal number exceeds a value."""
    return 0.5 * math.erfc(value / math.sqrt(2.0))


def quadratic_ratio_tail(values: FloatArray, ratio: float) -> float:
    """Return the probability that `sum w_j z_j^2 / sum z_j^2` exceeds a value, z standard normal.

    That is the chance of `sum (w_j - ratio) z_j^2 > 0`, by the saddlepoint approximation of
    Lugannani and Rice (1980), as Kuonen (1999) uses it for quadratic forms.

    Args:
        values: (n,) weights w, n at least 2.
        ratio: The value.
    """
    weights = values - ratio
    scale = float(np.max(np.abs(weights), initial=0.0))
    low, high = float(np.min(weights)), float(np.max(weights))
    if scale == 0.0 or high <= 0.0:
        return 0.0
    if low >= 0.0:
        return 1.0
    weights = weights / scale
    t = _saddlepoint(weights)
    below = 1.0 - 2.0 * t * weights
    curvature = 2.0 * float(np.sum((weights / below) ** 2))
    depth = math.copysign(math.sqrt(max(float(np.sum(np.log(below))), 0.0)), t)
    if abs(depth) < _AT_THE_MEAN:
        third = 8.0 * float(np.sum((weights / below) ** 3))
        return 0.5 - third / (6.0 * math.sqrt(2.0 * math.pi) * math.pow(curvature, 1.5))
    spread = t * math.sqrt(curvature)
    return normal_tail(depth + math.log(spread / depth) / depth)


def _saddlepoint(weights: FloatArray) -> float:
    """Return t with `sum w / (1 - 2 t w) = 0`, which grows with t, by bisection."""
    low, high = 0.5 / float(np.min(weights)), 0.5 / float(np.max(weights))
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        if float(np.sum(weights / (1.0 - 2.0 * middle * weights))) < 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def _gamma_parts(shape: float, x: float) -> tuple[float, float]:
    """Return the lower and the upper regularised gamma function; the smaller one is accurate."""
    front = math.exp(shape * math.log(x) - x - math.lgamma(shape))
    if x < shape + 1.0:
        term = total = 1.0 / shape
        for k in range(1, _MAX_TERMS):
            term *= x / (shape + k)
            total += term
            if term < total * _PRECISION:
                break
        return front * total, 1.0 - front * total
    b = x + 1.0 - shape
    c, d = 1.0 / _TINY, 1.0 / b
    fraction = d
    for k in range(1, _MAX_TERMS):
        a = -k * (k - shape)
        b += 2.0
        d = 1.0 / _not_zero(a * d + b)
        c = _not_zero(b + a / c)
        fraction *= c * d
        if abs(c * d - 1.0) < _PRECISION:
            break
    return 1.0 - front * fraction, front * fraction


def _beta(x: float, rest: float, a: float, b: float) -> float:
    """Return the regularised incomplete beta function I_x(a, b); `rest` is 1 - x, unrounded."""
    if x <= 0.0 or rest <= 0.0:
        return float(x > 0.0)
    if x > (a + 1.0) / (a + b + 2.0):
        return 1.0 - _beta(rest, x, b, a)
    log_front = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b)
    log_front += a * math.log(x) + b * math.log(rest)
    c, d = 1.0, 1.0 / _not_zero(1.0 - (a + b) * x / (a + 1.0))
    fraction = d
    for k in range(1, _MAX_TERMS):
        even = k * (b - k) * x / ((a + 2 * k - 1.0) * (a + 2 * k))
        odd = -(a + k) * (a + b + k) * x / ((a + 2 * k) * (a + 2 * k + 1.0))
        for term in (even, odd):
            d = 1.0 / _not_zero(1.0 + term * d)
            c = _not_zero(1.0 + term / c)
            fraction *= c * d
        if abs(c * d - 1.0) < _PRECISION:
            break
    return math.exp(log_front) * fraction / a


def _not_zero(value: float) -> float:
    return value if abs(value) > _TINY else _TINY
