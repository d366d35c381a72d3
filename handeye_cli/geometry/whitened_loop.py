"""Stations' loops as least squares of unit weights, which orthogonal steps keep exact.

With a noise of 1e-9 the products of the normal equations lose sixteen digits of eighteen; a
direction that nothing determines would then look determined by rounding alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.loop import LoopJacobians

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class WhitenedLoops:
    """Linearised loops of N stations, turned and scaled to residuals of unit covariance.

    Attributes:
        root: (N, 6, 6) lower roots of the residuals' covariances.
        residuals: (N, 6).
        design: (N, 6, 12) derivative by the perturbations of X and Z.
        by_poses: (N, 6, 12) derivative by those of A_i and B_i.
    """

    root: FloatArray
    residuals: FloatArray
    design: FloatArray
    by_poses: FloatArray


def whiten(loop: LoopJacobians, covariance: FloatArray) -> WhitenedLoops:
    """Divide linearised loops by the roots of their covariances `S_i = J_i C_i J_i'`.

    Args:
        loop: Of N stations, without leading axes.
        covariance: (N, 12, 12) of the perturbations of A_i and B_i.
    """
    by_poses = loop.by_poses
    carried = by_poses @ covariance @ np.swapaxes(by_poses, -1, -2)
    root = np.asarray(np.linalg.cholesky(carried), dtype=np.float64)
    rows = np.concatenate([loop.residuals[..., None], loop.by_unknowns, by_poses], axis=-1)
    rows = np.linalg.solve(root, rows)
    return WhitenedLoops(root, rows[..., 0], rows[..., 1:13], rows[..., 13:])


def least_squares(
    loops: WhitenedLoops, basis: FloatArray, fixed: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Solve the linearised loops for a step that is given in some directions.

    Args:
        loops: N stations.
        basis: (12, p) of the steps of X and Z that are looked for.
        fixed: (12,) the part of the step across them.

    Returns:
        The (12,) step that minimises the squares, and the (N, 12, 12) derivative of X and Z by the
        stations' poses: rows are the perturbations of X and Z, columns those of A_i and B_i.
    """
    back = basis @ _scaled_inverse(loops.design.reshape(-1, 12) @ basis)
    step = fixed - back @ (loops.residuals + loops.design @ fixed).reshape(-1)
    by_rows = np.moveaxis(back.reshape(12, -1, 6), 1, 0)
    return step, -by_rows @ loops.by_poses


def _scaled_inverse(matrix: FloatArray) -> FloatArray:
    """Return the pseudo-inverse, columns scaled so that metres and radians weigh alike."""
    scale = np.linalg.norm(matrix, axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    return np.asarray(np.linalg.pinv(matrix / scale) / scale[:, None])
