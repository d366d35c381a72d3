"""Distributions of error magnitudes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

MAX_OVER_RMS = 2.3285
"""99.9 % quantile of |v| over its RMS for an isotropic 3-vector: the largest of a thousand."""
_NODES = 1000
_KNOWN = 1e4
"""With more degrees of freedom than this a scale counts as known."""


def radius(covariance: FloatArray, probability: float, freedom: float = math.inf) -> float:
    """Return the radius that a normal vector's magnitude stays below with a given probability.

    Args:
        covariance: (d, d) covariance of the vector.
        probability: Between 0 and 1.
        freedom: Degrees of freedom with which the covariance's scale was estimated; infinite when
            it is known.

    Returns:
        The radius in the vector's unit.
    """
    weights = np.linalg.eigvalsh(covariance)
    weights = np.maximum(weights, 0.0)
    mean = float(np.sum(weights))
    if mean <= 0.0:
        return 0.0
    weights = weights[weights > 1e-9 * mean] / mean
    low, high = 0.0, 4.0
    while _exceeds(weights, high, freedom) > 1.0 - probability:
        low, high = high, 2.0 * high
    for _ in range(30):
        middle = 0.5 * (low + high)
        if _exceeds(weights, middle, freedom) > 1.0 - probability:
            low = middle
        else:
            high = middle
    return math.sqrt(0.5 * (low + high) * mean)


def _exceeds(weights: FloatArray, limit: float, freedom: float) -> float:
    """Return P(sum w_i z_i^2 > limit * chi2(freedom) / freedom) by Imhof's integral.

    Imhof, J. P. (1961), Computing the distribution of quadratic forms in normal variables.
    With a known scale the chi-square is the constant 1.
    """
    u = (np.arange(_NODES) + 0.5) / _NODES
    stretch = 1.0 / float(np.max(weights))
    x = stretch * u / (1.0 - u) ** 2
    slope = stretch * (1.0 + u) / (1.0 - u) ** 3
    spread = np.outer(weights, x)
    angle = 0.5 * np.sum(np.arctan(spread), axis=0)
    decay = 0.25 * np.sum(np.log1p(spread**2), axis=0)
    if freedom > _KNOWN:
        angle -= 0.5 * limit * x
    else:
        share = limit / freedom
        angle -= 0.5 * freedom * np.arctan(share * x)
        decay += 0.25 * freedom * np.log1p((share * x) ** 2)
    integrand = np.sin(angle) * np.exp(-decay) / x * slope
    return 0.5 + float(np.mean(integrand)) / math.pi
