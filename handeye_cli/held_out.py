"""Errors at stations that took no part in a calibration, and what the covariances predict for them.

The camera's pose by the robot is `A X`, by the camera `Z B^-1`; both should be one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.geometry import se3
from handeye_cli.records import FloatArray
from handeye_cli.solvers.problem import Solution

SIGNIFICANCE = 0.01
"""Chance that a good calibration is called inconsistent with its prediction."""


@dataclass(frozen=True)
class HeldOutErrors:
    """Errors of M stations.

    Attributes:
        vectors: (M, 6) perturbations that take `Z B^-1` to `A X`, in the reference frame.
        by_common: (M, 6, 12 + q) their derivatives by X, Z and the q errors that all stations share
            (`Chain.by_causes`).
        by_poses: (M, 6, 12) their derivatives by A_k and B_k.
        camera_T_target: (M, 4, 4) where robot and calibration expect the target.
    """

    vectors: FloatArray
    by_common: FloatArray
    by_poses: FloatArray
    camera_T_target: FloatArray

    @property
    def rotation(self) -> FloatArray:
        """(M,) rotation angles in radians."""
        return np.asarray(np.linalg.norm(self.vectors[:, 3:], axis=1))

    @property
    def translation(self) -> FloatArray:
        """(M,) distances in metres."""
        return np.asarray(np.linalg.norm(self.vectors[:, :3], axis=1))


@dataclass(frozen=True)
class HeldOutPrediction:
    """What is expected of the errors.

    Attributes:
        rotation: RMS angle, radians.
        translation: RMS distance, metres.
        chance: Probability of errors as large as the seen ones, or larger, if all is well.
    """

    rotation: float
    translation: float
    chance: float

    @property
    def consistent(self) -> bool:
        """Whether chance explains that the seen errors are as large as they are."""
        return self.chance > SIGNIFICANCE


def held_out_errors(chain: Chain, solution: Solution) -> HeldOutErrors:
    """Compare the camera's poses by robot and by camera at M stations.

    Args:
        chain: The stations.
        solution: X and Z of a calibration that has not seen them; (4, 4), or (M, 4, 4) where each
            station has a calibration of its own.
    """
    X, Z, to_camera = solution.X, solution.Z, se3.inverse(chain.B)
    by_robot, by_answer = se3.compose_jacobians(chain.A, X)
    by_target, by_inverse = se3.compose_jacobians(Z, to_camera)
    by_camera = by_inverse @ se3.inverse_jacobian(chain.B)
    by_robot = np.broadcast_to(by_robot, by_camera.shape)
    expected = chain.A @ X
    by_poses = np.concatenate([by_robot, -by_camera], axis=-1)
    by_causes = by_poses @ chain.by_causes
    return HeldOutErrors(
        vectors=se3.difference(expected, Z @ to_camera),
        by_common=np.concatenate([by_answer, -by_target, by_causes], axis=-1),
        by_poses=by_poses,
        camera_T_target=se3.inverse(expected) @ Z,
    )


def error_covariances(
    errors: HeldOutErrors, common: FloatArray, stations: FloatArray
) -> FloatArray:
    """Return the (M, 6, 6) covariances of the errors.

    Args:
        errors: Their derivatives.
        common: (12 + q, 12 + q), or one for each station: covariance of X, Z and what is shared.
        stations: (M, 12, 12) covariances of the stations' own poses.
    """
    return own_covariances(errors, stations) + _carried(errors.by_common, common)


def own_covariances(errors: HeldOutErrors, stations: FloatArray) -> FloatArray:
    """Return the (M, 6, 6) part of the errors' covariances that is the stations' own."""
    return _carried(errors.by_poses, stations)


def _carried(J: FloatArray, covariance: FloatArray) -> FloatArray:
    return np.asarray(J @ covariance @ np.swapaxes(J, -1, -2))


def predict_errors(
    errors: HeldOutErrors, common: FloatArray, stations: FloatArray, freedom: float
) -> HeldOutPrediction:
    """Predict the errors' RMS, and judge whether the seen ones are consistent with it.

    The calibration's error is common to all stations, so the squares are weighted with the full
    covariance. Their sum is chi-square, or F where the noise was estimated.

    Args:
        errors: The seen errors.
        common: (12 + q, 12 + q) covariance of X, Z and what all stations share.
        stations: (M, 12, 12) covariances of the stations' own poses.
        freedom: Degrees of freedom with which the noise was estimated; infinite when given.
    """
    shared = errors.by_common @ root_of(common)
    squares = weighted_squares(errors.vectors, own_covariances(errors, stations), shared)
    rotation, translation = rms_of(error_covariances(errors, common, stations))
    chance = chance_of(squares, errors.vectors.size, freedom)
    return HeldOutPrediction(rotation, translation, float(chance))


def rms_of(covariances: FloatArray) -> tuple[float, float]:
    """Return the RMS of rotation and translation that (M, 6, 6) covariances predict."""
    variances = np.einsum("nii->ni", covariances).mean(axis=0)
    translation, rotation = np.sqrt(se3.by_kind(variances)).tolist()
    return rotation, translation


def chance_of(
    squares: FloatArray | float, count: int, freedom: FloatArray | float = math.inf
) -> FloatArray:
    """Return the probability of weighted squares as large as these, or larger.

    Args:
        squares: (...) sums of squares, weighted with their covariance.
        count: How many independent squares each sums up.
        freedom: (...) degrees of freedom with which the scale of the covariance was estimated;
            infinite when known.
    """
    from scipy.special import chdtrc, fdtrc

    known = np.isinf(freedom)
    finite = np.where(known, 1.0, freedom)
    squares = np.asarray(squares)
    return np.asarray(
        np.where(known, chdtrc(count, squares), fdtrc(count, finite, squares / count))
    )


def root_of(covariance: FloatArray) -> FloatArray:
    """Return a square root of a covariance, which may be singular."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def weighted_squares(
    vectors: FloatArray, own: FloatArray, shared: FloatArray, fitted: FloatArray | None = None
) -> float:
    """Return e' (D + U U')^-1 e without forming the (6 M, 6 M) matrix (Woodbury's identity).

    Args:
        vectors: (M, 6) errors e.
        own: (M, 6, 6) blocks of D.
        shared: (M, 6, k) rows of U: what unit errors, common to all stations, add.
        fitted: (M, 6, l) derivatives by unknowns that are fitted: the squares are the smallest.
    """
    free = np.zeros((*shared.shape[:-1], 0)) if fitted is None else fitted
    common = np.concatenate([shared, free], axis=-1)
    weighted = np.linalg.solve(own, np.concatenate([common, vectors[..., None]], axis=-1))
    known = np.repeat([1.0, 0.0], [shared.shape[-1], free.shape[-1]])
    inner = np.diag(known) + np.einsum("nij,nik->jk", common, weighted[..., :-1])
    along = np.einsum("nij,ni->j", common, weighted[..., -1])
    scale = 1.0 / np.sqrt(np.diag(inner))
    part = scale * np.linalg.solve(scale[:, None] * inner * scale, scale * along)
    return float(np.sum(vectors * weighted[..., -1])) - float(along @ part)
