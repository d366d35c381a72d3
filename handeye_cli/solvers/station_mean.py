"""The target's pose as the mean over the stations, the paper's average of H_RC."""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry import se3
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.solvers.problem import FloatArray


def mean_target(A: FloatArray, B: FloatArray, X: FloatArray) -> FloatArray:
    """Return the (..., 4, 4) mean of `A_i X B_i` over the stations.

    Args:
        A: (..., N, 4, 4) reference_T_mount.
        B: (..., N, 4, 4) camera_T_target.
        X: (..., 4, 4) mount_T_camera.
    """
    return se3.mean(A @ X[..., None, :, :] @ B)


def mean_influence(A: FloatArray, B: FloatArray, X: FloatArray, answer: FloatArray) -> FloatArray:
    """Return (N, 6, 12): how that mean moves with the perturbations of A_i and B_i.

    Args:
        A: (N, 4, 4) reference_T_mount.
        B: (N, 4, 4) camera_T_target.
        X: (4, 4) mount_T_camera.
        answer: (N, 6, 12) how X itself moves with them.
    """
    loop = loop_jacobians(A, B, X, mean_target(A, B, X))
    own = loop.by_poses / len(A)
    return np.asarray(own + np.mean(loop.by_unknowns[..., :6], axis=0) @ answer)
