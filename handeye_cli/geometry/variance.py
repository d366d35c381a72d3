"""Noise levels from residuals: restricted maximum likelihood for variance components.

The residuals of N stations have covariances `S_i = C_i + sum_k v_k V_ik` with known C and V and
unknown variances v, and a mean `J_i x` with unknown x. REML is the likelihood of what is left after
x has been fitted, so few stations do not make the noise look small.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_MAX_STEPS = 100
_TOLERANCE = 1e-9
_LARGEST_STEP = 2.0
_RANK_TOLERANCE = 1e-10


class VarianceComponents(NamedTuple):
    """Estimated variances.

    Attributes:
        variances: (K,) estimates, not below the floor.
        information: (K, K) on the variances; its inverse is their covariance.
        converged: Whether the iteration settled.
    """

    variances: FloatArray
    information: FloatArray
    converged: bool


def estimate(
    *,
    residuals: FloatArray,
    design: FloatArray,
    known: FloatArray,
    shapes: FloatArray,
    start: FloatArray,
    floor: FloatArray,
) -> VarianceComponents:
    """Estimate variance components by Fisher scoring on their logarithms.

    Args:
        residuals: (N, d) residual of each station.
        design: (N, d, p) derivative of the residuals by the unknowns.
        known: (N, d, d) known part of the covariance.
        shapes: (K, N, d, d) derivative of the covariance by each variance.
        start: (K,) first guesses, positive.
        floor: (K,) smallest variances considered, positive.
    """
    variances = np.maximum(start, floor)
    design = _orthonormal(design)
    damping, converged = 1e-3, False
    likelihood, score, information = _likelihood(residuals, design, known, shapes, variances)
    for _ in range(_MAX_STEPS):
        value = likelihood
        log_score = variances * score
        log_information = variances[:, None] * information * variances
        damped = log_information + damping * np.diag(np.diag(log_information) + 1e-9)
        step = np.clip(np.linalg.solve(damped, log_score), -_LARGEST_STEP, _LARGEST_STEP)
        tried = np.maximum(variances * np.exp(step), floor)
        likelihood, tried_score, tried_information = _likelihood(
            residuals, design, known, shapes, tried
        )
        if likelihood < value - 1e-12 * abs(value):
            likelihood, damping = value, damping * 10.0
            if damping > 1e10:
                break
            continue
        moved = np.max(np.abs(np.log(tried / variances)))
        variances, score, information = tried, tried_score, tried_information
        damping = max(damping * 0.1, 1e-9)
        if moved < _TOLERANCE or likelihood - value < 1e-12 * max(abs(value), 1.0):
            converged = True
            break
    return VarianceComponents(variances, information, converged)


def _orthonormal(design: FloatArray) -> FloatArray:
    """Return a design of full rank with the same span; columns that say nothing are dropped."""
    flat = design.reshape(-1, design.shape[-1])
    scale = np.linalg.norm(flat, axis=0)
    basis, size, _ = np.linalg.svd(flat / np.where(scale > 0, scale, 1.0), full_matrices=False)
    return basis[:, size > _RANK_TOLERANCE * size[0]].reshape(*design.shape[:-1], -1)


def _likelihood(
    residuals: FloatArray,
    design: FloatArray,
    known: FloatArray,
    shapes: FloatArray,
    variances: FloatArray,
) -> tuple[float, FloatArray, FloatArray]:
    """Return the restricted log-likelihood, its score and its expected information, in O(N).

    The design must have full rank.
    """
    count, size = len(shapes), design.shape[-1]
    covariance = known + _rows(shapes, count).T.dot(variances).reshape(known.shape)
    weight = np.linalg.inv(covariance)
    WJ = weight @ design
    J_flat, WJ_flat = design.reshape(-1, size), WJ.reshape(-1, size)
    M = J_flat.T @ WJ_flat
    M_inverse = np.linalg.inv(M)
    fitted = M_inverse @ (WJ_flat.T @ residuals.ravel())
    Pe = (weight @ (residuals - design @ fitted)[..., None])[..., 0]
    WV, VWJ = weight @ shapes, shapes @ WJ
    MG = M_inverse @ (WJ_flat.T @ VWJ.reshape(count, -1, size))
    trace = _rows(shapes, count) @ weight.ravel() - np.trace(MG, axis1=1, axis2=2)
    quadratic = _rows(shapes @ Pe[..., None], count) @ Pe.ravel()
    mixed = _rows(VWJ @ M_inverse, count) @ _rows(weight @ VWJ, count).T
    crossed = _trace_of_products(WV) + _trace_of_products(MG)
    information = 0.5 * crossed - mixed
    log_det = np.sum(np.linalg.slogdet(covariance)[1]) + np.linalg.slogdet(M)[1]
    value = -0.5 * (log_det + float(residuals.ravel() @ Pe.ravel()))
    return float(value), 0.5 * (quadratic - trace), information


def _rows(values: FloatArray, count: int) -> FloatArray:
    """Return arrays as rows: their products with each other are sums over everything else."""
    return values.reshape(count, -1)


def _trace_of_products(matrices: FloatArray) -> FloatArray:
    """Return the (K, K) traces of the products of (K, ..., m, m) matrices, summed over the rest."""
    count = len(matrices)
    return np.asarray(_rows(matrices, count) @ _rows(np.swapaxes(matrices, -1, -2), count).T)
