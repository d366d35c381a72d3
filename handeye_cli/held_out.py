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

_SIGNIFICANCE = 0.01
"""Chance that a good calibration is called inconsistent with its prediction."""


@dataclass(frozen=True)
class HeldOutErrors:
    """Errors of M stations.

    Attributes:
        vectors: (M, 6) perturbations that take `Z B^-1` to `A X`, in the reference frame.
        by_solution: (M, 6, 12) their derivatives by X and Z.
        by_poses: (M, 6, 12) their derivatives by A_k and B_k.
    """

    vectors: FloatArray
    by_solution: FloatArray
    by_poses: FloatArray

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
        consistent: Whether chance explains that the seen errors are as large as they are.
    """

    rotation: float
    translation: float
    consistent: bool


def held_out_errors(chain: Chain, solution: Solution) -> HeldOutErrors:
    """Compare the camera's poses by robot and by camera at M stations.

    Args:
        chain: The stations.
        solution: X and Z of a calibration that has not seen them.
    """
    X, Z, to_camera = solution.X, solution.Z, se3.inverse(chain.B)
    by_robot, by_answer = se3.compose_jacobians(chain.A, X)
    by_target, by_inverse = se3.compose_jacobians(Z, to_camera)
    by_camera = by_inverse @ se3.inverse_jacobian(chain.B)
    by_robot = np.broadcast_to(by_robot, by_camera.shape)
    return HeldOutErrors(
        vectors=se3.difference(chain.A @ X, Z @ to_camera),
        by_solution=np.concatenate([by_answer, -by_target], axis=-1),
        by_poses=np.concatenate([by_robot, -by_camera], axis=-1),
    )


def predict_errors(
    errors: HeldOutErrors, solution: FloatArray, stations: FloatArray, freedom: float
) -> HeldOutPrediction:
    """Predict the errors' RMS, and judge whether the seen ones are consistent with it.

    The calibration's error is common to all stations, so the squares are weighted with the full
    covariance. Their sum is chi-square, or F where the noise was estimated.

    Args:
        errors: The seen errors.
        solution: (12, 12) covariance of X and Z.
        stations: (M, 12, 12) covariances of the stations' own poses.
        freedom: Degrees of freedom with which the noise was estimated; infinite when given.
    """
    from scipy.special import chdtrc, fdtrc

    own = errors.by_poses @ stations @ np.swapaxes(errors.by_poses, -1, -2)
    shared = errors.by_solution @ solution @ np.swapaxes(errors.by_solution, -1, -2)
    traces = np.einsum("nii->ni", own + shared).mean(axis=0)
    count = errors.vectors.size
    squares = _weighted_squares(errors, solution, own)
    tail = chdtrc(count, squares) if math.isinf(freedom) else fdtrc(count, freedom, squares / count)
    return HeldOutPrediction(
        rotation=float(np.sqrt(traces[3:].sum())),
        translation=float(np.sqrt(traces[:3].sum())),
        consistent=bool(tail > _SIGNIFICANCE),
    )


def _weighted_squares(errors: HeldOutErrors, solution: FloatArray, own: FloatArray) -> float:
    """Return e' (D + U C U')^-1 e without forming the (6 M, 6 M) matrix (Woodbury's identity)."""
    values, vectors = np.linalg.eigh(solution)
    shared = errors.by_solution @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    weighted = np.linalg.solve(own, np.concatenate([shared, errors.vectors[..., None]], axis=-1))
    inner = np.eye(12) + np.einsum("nij,nik->jk", shared, weighted[..., :-1])
    along = np.einsum("nij,ni->j", shared, weighted[..., -1])
    plain = float(np.sum(errors.vectors * weighted[..., -1]))
    return plain - float(along @ np.linalg.solve(inner, along))
