"""The loop every station closes, `A_i X B_i = Z`, with its derivatives.

A = reference_T_mount (robot), X = mount_T_camera (the answer), B = camera_T_target (camera),
Z = reference_T_target. All perturbations are in the respective parent frame.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations, se3

FloatArray = NDArray[np.float64]


class LoopJacobians(NamedTuple):
    """Residuals of all stations and their first derivatives.

    Attributes:
        residuals: (..., N, 6) perturbation that takes Z to `A_i X B_i`.
        by_robot: (..., N, 6, 6) derivative by the perturbation of A_i.
        by_camera: (..., N, 6, 6) by that of B_i.
        by_unknowns: (..., N, 6, 12) by those of X and Z.
    """

    residuals: FloatArray
    by_robot: FloatArray
    by_camera: FloatArray
    by_unknowns: FloatArray

    @property
    def by_poses(self) -> FloatArray:
        """(..., N, 6, 12) derivative by the perturbations of A_i and B_i together."""
        return np.concatenate([self.by_robot, self.by_camera], axis=-1)


def loop_jacobians(A: FloatArray, B: FloatArray, X: FloatArray, Z: FloatArray) -> LoopJacobians:
    """Linearise the loop at (X, Z).

    Args:
        A: (..., N, 4, 4) reference_T_mount.
        B: (..., N, 4, 4) camera_T_target.
        X: (..., 4, 4) mount_T_camera.
        Z: (..., 4, 4) reference_T_target.
    """
    X, Z = X[..., None, :, :], Z[..., None, :, :]
    AX = A @ X
    closed = AX @ B
    by_robot, by_rest = se3.compose_jacobians(A, X @ B)
    by_answer, _ = se3.compose_jacobians(X, B)
    _, by_camera = se3.compose_jacobians(AX, B)
    residuals = se3.difference(closed, Z)
    left = rotations.left_jacobian_inverse(residuals[..., 3:])
    by_constant = np.zeros((*residuals.shape, 6))
    by_constant[..., :3, :3] = -np.eye(3)
    by_constant[..., 3:, 3:] = -rotations.left_jacobian_inverse(-residuals[..., 3:])
    by_answer = _turned(left, by_rest @ by_answer)
    return LoopJacobians(
        residuals,
        _turned(left, by_robot),
        _turned(left, by_camera),
        np.concatenate([by_answer, by_constant], axis=-1),
    )


def _turned(left: FloatArray, J: FloatArray) -> FloatArray:
    """Carry the product's rotation part over to the logarithm's."""
    return np.concatenate([J[..., :3, :], left @ J[..., 3:, :]], axis=-2)


def isotropic_covariance(rotation: float, translation: float) -> FloatArray:
    """Return the (6, 6) covariance of a pose whose errors have these RMS magnitudes."""
    return np.diag(np.repeat([translation**2 / 3.0, rotation**2 / 3.0], 3))
