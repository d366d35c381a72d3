"""How far from the truth an answer is expected to be: first-order covariance, and the paper's."""

from __future__ import annotations

import math

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.geometry import error_formulas, error_radius
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.geometry.scaled_inverse import scaled_pseudo_inverse
from handeye_cli.noise_levels import NoiseModel
from handeye_cli.records import FloatArray, IntArray, PaperPrediction, PredictedError
from handeye_cli.solvers.motions import interstation_motions
from handeye_cli.solvers.problem import Solution

_PROBABILITY = 0.95
_PARTS = (slice(3, 6), slice(0, 3))
"""Rotation and translation of the answer."""


def solution_covariance(influence: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return the (12, 12) covariance of X and Z together.

    Args:
        influence: (N, 12, 12) how they move with each station's poses.
        covariance: (N, 12, 12) of those poses; stations are independent.
    """
    # as one product of long matrices: over thousands of stations far faster than a sum of triples
    weighted = np.moveaxis(influence @ covariance, 0, 1).reshape(influence.shape[1], -1)
    total = weighted @ np.moveaxis(influence, 0, 1).reshape(influence.shape[1], -1).T
    return np.asarray((total + total.T) / 2)


def predicted_error(
    influence: FloatArray,
    model: NoiseModel,
    paper: PaperPrediction | None,
    shared: FloatArray | None = None,
) -> PredictedError:
    """Return RMS and 95 % radius of the answer's rotation and translation error.

    The RMS is that of the covariance. The radius is wider where noise was estimated: the variance
    of the estimate is matched by a chi-square with as many degrees of freedom (Satterthwaite).

    Args:
        influence: (N, 12, 12) of the solution.
        model: The noise of the stations' poses.
        paper: The paper's own prediction, to stand beside it.
        shared: (12, 12) covariance from what all stations have in common, such as intrinsics.
    """
    covariance = _total(influence, model, shared)
    slopes = [solution_covariance(influence, shape) for shape in model.shapes]
    rms, wide = [], []
    for part in _PARTS:
        block = covariance[part, part]
        freedom = _part_freedom(covariance, slopes, part, model)
        rms.append(float(np.sqrt(np.trace(block))))
        wide.append(error_radius.radius(block, _PROBABILITY, freedom))
    return PredictedError(rms[0], rms[1], wide[0], wide[1], paper)


def scale_freedom(
    influence: FloatArray, model: NoiseModel, shared: FloatArray | None = None
) -> float:
    """Return the degrees of freedom with which the scale of a prediction was estimated.

    The smaller one of rotation and translation is taken; infinite where the noise was given.

    Args:
        influence: (N, 12, 12) of the solution.
        model: The noise of the stations' poses.
        shared: (12, 12) covariance from what all stations have in common.
    """
    covariance = _total(influence, model, shared)
    slopes = [solution_covariance(influence, shape) for shape in model.shapes]
    return min(_part_freedom(covariance, slopes, part, model) for part in _PARTS)


def noise_freedom(
    chain: Chain, solution: Solution, model: NoiseModel, part: slice = slice(0, 6)
) -> float:
    """Return the degrees of freedom with which the size of the stations' noise was estimated.

    Squares of other stations' errors, weighted with the inverse of an estimated covariance, are on
    average larger than with that of the true one; as many degrees of freedom give F the same mean.
    Each level counts by its share in the covariances of the loops' residuals, which are those of
    the errors at other stations as well.

    Args:
        chain: The stations it was estimated from.
        solution: Where to linearise their loops.
        model: Their noise.
        part: Of the six residuals, those that count: the translation is (0, 3).

    Returns:
        At least 1, which is no estimate at all; infinite where the noise was given.
    """
    if not len(model.shapes):
        return math.inf
    loop = loop_jacobians(chain.A, chain.B, solution.X, solution.Z)
    J = loop.by_poses[:, part]
    inverse = np.linalg.inv(J @ model.covariance @ np.swapaxes(J, -1, -2))
    shares = inverse @ (J @ model.shapes @ np.swapaxes(J, -1, -2))
    products = np.einsum("knij,lnji->kl", shares, shares) / len(chain.A)
    excess = float(np.sum(scaled_pseudo_inverse(model.information) * products)) / J.shape[1]
    return max(2.0 / excess, 1.0) if excess > 0.0 else math.inf


def _total(influence: FloatArray, model: NoiseModel, shared: FloatArray | None) -> FloatArray:
    covariance = solution_covariance(influence, model.covariance)
    return covariance if shared is None else covariance + shared


def _part_freedom(
    covariance: FloatArray, slopes: list[FloatArray], part: slice, model: NoiseModel
) -> float:
    gradient = np.array([np.trace(slope[part, part]) for slope in slopes])
    return _freedom(float(np.trace(covariance[part, part])), gradient, model.information)


def _freedom(total: float, gradient: FloatArray, information: FloatArray) -> float:
    """Return the degrees of freedom of an estimated mean square; infinite where all was given.

    Less than one is no estimate at all, and is counted as one.
    """
    if gradient.size == 0 or total <= 0.0:
        return math.inf
    variance = float(gradient @ scaled_pseudo_inverse(information) @ gradient)
    return max(2.0 * total**2 / variance, 1.0) if variance > 0.0 else math.inf


def paper_prediction(
    chain: Chain, pairs: IntArray, covariance: FloatArray
) -> PaperPrediction | None:
    """Return the error that eq. (29)-(33) predict for the closed form with these pairs.

    Args:
        chain: The stations.
        pairs: (m, 2) interstation pairs.
        covariance: (N, 12, 12) of the perturbations of A_i and B_i.

    Returns:
        The prediction, or None where a factor of the formulas vanishes.
    """
    _, motion_c = interstation_motions(chain.A, chain.B, pairs)
    factors = error_formulas.critical_factors(chain.A, chain.B, motion_c, pairs)
    if not (factors.angle > 0 and factors.sine > 0):
        return None
    traces = np.einsum("nii->ni", covariance).mean(axis=0).reshape(4, 3).sum(axis=1)
    translation_g, rotation_g, translation_c, rotation_c = np.sqrt(traces).tolist()
    noise = error_formulas.StationNoise(rotation_g, translation_g, rotation_c, translation_c)
    return PaperPrediction(
        rotation=error_formulas.rotation_sigma(factors, noise),
        translation=error_formulas.translation_sigma(factors, noise),
        rotation_max=error_formulas.rotation_max(factors, noise),
        translation_max=error_formulas.translation_max(factors, noise),
    )
