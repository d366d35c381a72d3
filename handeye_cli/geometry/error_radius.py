"""Distributions of error magnitudes: radii that normal vectors stay below."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

MAX_OVER_RMS = 2.3285
"""99.9 % quantile of |v| over its RMS for an isotropic 3-vector: the largest of a thousand."""
_RINGS = 48
_RING_POINTS = 48
_NODES = 8001
_SETTLED = 1e-10
"""Width of the bracket around the logarithm of a squared radius at which it has been found."""
_TAIL = 36.0
"""Natural logarithm by which the density has decayed where its integration ends."""


def radius(covariance: FloatArray, probability: float, freedom: float = math.inf) -> float:
    """Return the radius that a normal 3-vector's magnitude stays below with a given probability.

    In a direction u of the whitened vector the radius is `rho sqrt(u' C u)`, with rho^2 a
    chi-square of three degrees of freedom, or 3 F(3, freedom) where the scale of C was estimated.
    The probability is the mean over all directions of that one-dimensional distribution.

    Args:
        covariance: (3, 3) covariance of the vector.
        probability: Between 0 and 1.
        freedom: Degrees of freedom with which the covariance's scale was estimated, at least 1;
            infinite when it is known.

    Returns:
        The radius in the vector's unit.

    Raises:
        ValueError: Fewer degrees of freedom than one, or no number.
    """
    if not freedom >= 1.0:
        raise ValueError(f"expected at least 1 degree of freedom, found {freedom}")
    weights = np.maximum(np.linalg.eigvalsh(covariance), 0.0)
    total = float(np.sum(weights))
    if total <= 0.0:
        return 0.0
    stretch = np.log(np.maximum(_directions() @ (weights / total), 1e-300))
    grid, cumulative = _log_distribution(freedom)
    low, high = grid[0] + math.log(1e-6), grid[-1]
    while high - low > _SETTLED:
        middle = 0.5 * (low + high)
        if float(np.mean(np.interp(middle - stretch, grid, cumulative))) < probability:
            low = middle
        else:
            high = middle
    return math.sqrt(total * math.exp(0.5 * (low + high)))


def _directions() -> FloatArray:
    """Return (n, 3) squared components of unit vectors spread evenly over the octant."""
    height = (np.arange(_RINGS) + 0.5) / _RINGS
    angle = (np.arange(_RING_POINTS) + 0.5) * (0.5 * np.pi / _RING_POINTS)
    across = (1.0 - height**2)[:, None]
    x, y = across * np.cos(angle) ** 2, across * np.sin(angle) ** 2
    z = np.broadcast_to((height**2)[:, None], x.shape)
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


def _log_distribution(freedom: float) -> tuple[FloatArray, FloatArray]:
    """Return log(rho^2) on a grid and its distribution function there."""
    known = math.isinf(freedom)
    upper = math.log(4.0 * _TAIL) if known else math.log(freedom + 4.0 * _TAIL)
    upper += 0.0 if known else 2.0 * _TAIL / freedom
    grid = np.linspace(-_TAIL, upper, _NODES)
    x = np.exp(grid)
    decay = -0.5 * x if known else -0.5 * (3.0 + freedom) * np.log1p(x / freedom)
    density = np.exp(1.5 * grid + decay - np.max(1.5 * grid + decay))
    steps = 0.5 * (density[1:] + density[:-1])
    cumulative = np.concatenate([[0.0], np.cumsum(steps)])
    return grid, cumulative / cumulative[-1]
