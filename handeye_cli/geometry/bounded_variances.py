"""Variances of a few dense covariances that explain residuals best, none below its floor.

The likelihood is that of `geometry.variance`, of residuals that no unknowns are left in. Where
components are much alike, one of them often ends at its floor; scoring on logarithms creeps there,
while steps of the quadratic approximation within the bounds reach it at once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_MAX_STEPS = 60
_MORE_DAMPING = 10.0


class _State(NamedTuple):
    """Log-likelihood at some variances, its (K,) slope and its (K, K) expected curvature."""

    value: float
    score: FloatArray
    information: FloatArray


def bounded_variances(
    *,
    residuals: FloatArray,
    known: FloatArray,
    shapes: FloatArray,
    start: FloatArray,
    floor: FloatArray,
    gain: float = 1e-3,
) -> FloatArray:
    """Return the (K,) variances v for which `known + sum v_k shapes_k` is the likeliest covariance.

    Args:
        residuals: (n,) with a mean of zero.
        known: (n, n) part of their covariance.
        shapes: (K, n, n) what each variance adds to it.
        start: (K,) first guesses.
        floor: (K,) smallest variances considered, positive.
        gain: Of the log-likelihood, by a step that is no longer worth it.
    """
    variances = np.maximum(start, floor)
    state = _state(residuals, known, shapes, variances)
    damping = 0.0
    for _ in range(_MAX_STEPS):
        curvature = state.information + damping * np.diag(np.diag(state.information))
        step = _bounded_step(state.score, curvature, floor - variances)
        if state.score @ step - 0.5 * step @ curvature @ step < gain:
            break
        tried = _state(residuals, known, shapes, variances + step)
        if tried.value < state.value:
            damping = max(_MORE_DAMPING * damping, 1.0)
            continue
        better = tried.value - state.value
        variances, state = variances + step, tried
        damping = damping / _MORE_DAMPING if damping > 1.0 else 0.0
        if better < gain:
            break
    return variances


def _state(
    residuals: FloatArray, known: FloatArray, shapes: FloatArray, variances: FloatArray
) -> _State:
    covariance = known + np.tensordot(variances, shapes, axes=1)
    weight = np.linalg.inv(covariance)
    weighted = weight @ residuals
    shares = weight @ shapes
    score = (shapes @ weighted) @ weighted - np.trace(shares, axis1=1, axis2=2)
    information = np.einsum("kij,lji->kl", shares, shares, optimize=True)
    value = -np.linalg.slogdet(covariance)[1] - residuals @ weighted
    return _State(0.5 * float(value), 0.5 * score, 0.5 * information)


def _bounded_step(score: FloatArray, curvature: FloatArray, least: FloatArray) -> FloatArray:
    """Return the (K,) step, no smaller than `least`, towards the top of a quadratic.

    What would fall below its bound is put there for good, and the others are solved anew.
    """
    free: BoolArray = np.ones(len(score), dtype=bool)
    step = np.zeros(len(score))
    while free.any():
        step[~free] = least[~free]
        slope = score[free] - curvature[np.ix_(free, ~free)] @ step[~free]
        step[free] = np.linalg.solve(curvature[np.ix_(free, free)], slope)
        below = free & (step < least)
        if not below.any():
            return step
        free &= ~below
    return least
