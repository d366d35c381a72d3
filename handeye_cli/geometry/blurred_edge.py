"""Blurred edges and crossings of edges, in single precision, far finer than a grey level."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

SingleArray = NDArray[np.float32]

_SERIES = np.array([-1.821255978, 1.781477937, -0.356563782, 0.319381530], dtype=np.float32)
_FARTHEST = np.float32(-80.0)
"""Least exponent of the density."""
_TERMS = 4
"""Terms of Mehler's series: for edges at 45 deg the rest is half a grey level."""


def normal_distribution(x: SingleArray) -> tuple[SingleArray, SingleArray]:
    """Return the normal distribution function, to 1e-7, and its density.

    The function is Abramowitz and Stegun's approximation 26.2.17.

    Args:
        x: (...) arguments in standard deviations.
    """
    # in place, as time goes into memory here
    density = np.float32(-0.5) * x
    density *= x
    # numbers near nothing are slow
    np.maximum(density, _FARTHEST, out=density)
    np.exp(density, out=density)
    density *= np.float32(1.0 / math.sqrt(2.0 * math.pi))
    t = np.abs(x)
    t *= np.float32(0.2316419)
    t += np.float32(1.0)
    np.reciprocal(t, out=t)
    share = np.float32(1.330274429) * t
    for coefficient in _SERIES:
        share += coefficient
        share *= t
    share *= density
    # that is the tail's share, on either side
    np.subtract(np.float32(0.5), share, out=share)
    np.copysign(share, x, out=share)
    share += np.float32(0.5)
    return share, density


def crossing(
    distances: SingleArray, shear: SingleArray, core: int
) -> tuple[SingleArray, SingleArray]:
    """Return the blurred product of two signs, as that of the squares where two edges cross.

    For distances h and k it is the mean of sign(h + e) sign(k + f) over normal e and f of variance
    1 and correlation r, by Mehler's series for the bivariate normal distribution

        (2 Phi(h) - 1)(2 Phi(k) - 1) + 4 phi(h) phi(k) sum_n r^(n+1) / (n+1)! He_n(h) He_n(k)

    Args:
        distances: (2, n, m) from the two edges, in standard deviations of the blur.
        shear: (n,) cosine r of the angle between the edges' normals.
        core: How many of the m points, the first ones, need the series; the others are more than
            four standard deviations away from one of the edges.

    Returns:
        (n, m) values in [-1, 1] and their (2, n, m) derivatives by the distances.
    """
    covered, density = normal_distribution(distances)
    signs = 2.0 * covered - 1.0
    value = signs[0] * signs[1]
    slopes = 2.0 * density * signs[::-1]
    now, following = np.ones_like(distances[..., :core]), distances[..., :core]
    factor = 4.0 * density[0, :, :core] * density[1, :, :core]
    for n in range(1, _TERMS + 1):
        factor = factor * (shear[:, None] / np.float32(n))
        value[:, :core] += factor * now[0] * now[1]
        slopes[..., :core] -= factor * following * now[::-1]
        now, following = following, distances[..., :core] * following - np.float32(n) * now
    return value, slopes
