"""The second stage of the separable methods: with R_cg known, T_cg is linear, eq. (15)."""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry import rotations
from handeye_cli.solvers.problem import FloatArray


def translation_system(
    R: FloatArray, motion_g: FloatArray, motion_c: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the (..., m, 3, 3) matrices and (..., m, 3) right-hand sides of eq. (15).

    The matrices have the leading axes of `motion_g`, the right-hand sides those of all arguments.

    Args:
        R: (..., 3, 3) rotation R_cg.
        motion_g: (..., m, 4, 4) motions of the mount.
        motion_c: (..., m, 4, 4) motions of the camera.
    """
    carried = motion_c[..., :3, 3] @ np.swapaxes(R, -1, -2)
    return motion_g[..., :3, :3] - np.eye(3), carried - motion_g[..., :3, 3]


def least_squares(rows: FloatArray, right: FloatArray) -> FloatArray:
    """Solve (..., m, 3, 3) blocks of equations with (..., m, 3) right-hand sides together.

    Leading axes broadcast: several right-hand sides share one decomposition.
    """
    matrix = rows.reshape(*rows.shape[:-3], -1, 3)
    vector = right.reshape(*right.shape[:-2], -1, 1)
    return np.asarray((np.linalg.pinv(matrix) @ vector)[..., 0])


def solve_translation(R: FloatArray, motion_g: FloatArray, motion_c: FloatArray) -> FloatArray:
    """Return the (..., 3) translations T_cg; arguments as in `translation_system`."""
    return least_squares(*translation_system(R, motion_g, motion_c))


def separable_influence(
    X: FloatArray, motion_g: FloatArray, motion_c: FloatArray, rotation_row: FloatArray
) -> FloatArray:
    """Return how X moves with the motions when T_cg follows from R_cg by eq. (15).

    Args:
        X: (4, 4) solution.
        motion_g: (m, 4, 4) motions of the mount.
        motion_c: (m, 4, 4) motions of the camera.
        rotation_row: (m, 3, 12) the perturbation of R_cg by those of H_gij and H_cij.

    Returns:
        (m, 6, 12): rows are the perturbation of X, columns those of H_gij and H_cij.
    """
    R, T = X[:3, :3], X[:3, 3]
    rows, _ = translation_system(R, motion_g, motion_c)
    back = np.linalg.pinv(rows.reshape(-1, 3)).reshape(3, -1, 3)
    residual = np.zeros((len(rows), 3, 12))
    residual[:, :, :3], residual[:, :, 6:9] = np.eye(3), -R
    residual[:, :, 3:6] = -rotations.skew(motion_g[:, :3, :3] @ T)
    by_turn = np.einsum("imk,mkl->il", back, rotations.skew(motion_c[:, :3, 3] @ R.T))
    translation_row = -np.einsum("imk,mkl->mil", back, residual) - by_turn @ rotation_row
    return np.concatenate([translation_row, rotation_row], axis=1)
