"""Andreff, Horaud and Espiau 1999: the elements of R_cg and T_cg together, by linear equations.

`R_g R_cg R_c' = R_cg` and eq. (15) of a motion are twelve equations in twelve unknowns. The factor
of the rotation's elements, which the method leaves to the translations, is fixed to that of a
rotation, and the equations are weighed so that the unit of length does not matter: `kronecker`.

N. Andreff, R. Horaud and B. Espiau, "On-line hand-eye calibration", 2nd Int. Conf. on 3-D Digital
Imaging and Modeling, 1999.
"""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry import rotations, se3
from handeye_cli.solvers.kronecker import (
    by_turn,
    kron,
    null_rotations,
    row_weights,
    scaled_influence,
    solve_scaled,
)
from handeye_cli.solvers.motions import influence_from_motions, interstation_motions
from handeye_cli.solvers.problem import FloatArray, Problem, Solution
from handeye_cli.solvers.signs import rough_rotation
from handeye_cli.solvers.station_mean import mean_target


def solve(problem: Problem) -> Solution:
    """Solve for X = mount_T_camera from the motions, and for Z as the mean over the stations.

    Args:
        problem: Stations and pairs; at least two pairs with different axes.
    """
    motion_g, motion_c = interstation_motions(problem.A, problem.B, problem.pairs)
    rows, right = equations(motion_g, motion_c)
    rough = rough_rotation(motion_g, motion_c)[..., None, :, :]
    R = null_rotations(rows[..., :9, :9], rough)
    weights = row_weights(motion_g, motion_c)
    X = pose_of(solve_scaled(weights[..., None] * rows, weights * right, R))
    return Solution(X, mean_target(problem.A, problem.B, X))


def equations(motion_g: FloatArray, motion_c: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (..., m, 12, 12) equations in (R_cg, T_cg) and the (..., m, 12) right-hand sides.

    Args:
        motion_g: (..., m, 4, 4) motions of the mount.
        motion_c: (..., m, 4, 4) motions of the camera.
    """
    R_g, t_g, t_c = motion_g[..., :3, :3], motion_g[..., :3, 3], motion_c[..., :3, 3]
    rows, right = np.zeros((*R_g.shape[:-2], 12, 12)), np.zeros((*R_g.shape[:-2], 12))
    rows[..., :9, :9] = np.eye(9) - kron(R_g, motion_c[..., :3, :3])
    rows[..., 9:, :9] = np.einsum("ij,...k->...ijk", np.eye(3), t_c).reshape(*t_c.shape, 9)
    rows[..., 9:, 9:] = np.eye(3) - R_g
    right[..., 9:] = t_g
    return rows, right


def pose_of(unknowns: FloatArray) -> FloatArray:
    """Return the (..., 4, 4) poses of (..., 12) unknowns, with the nearest rotation."""
    elements = unknowns[..., :9].reshape(*unknowns.shape[:-1], 3, 3)
    return se3.from_parts(rotations.project_to_so3(elements), unknowns[..., 9:])


def influence(problem: Problem, solution: Solution) -> FloatArray:
    """Return how X and Z move with each station's poses, to first order.

    Args:
        problem: Stations without leading axes.
        solution: Its solution.

    Returns:
        (N, 12, 12): rows are the perturbations of X and Z, columns those of A_i and B_i.
    """
    motion_g, motion_c = interstation_motions(problem.A, problem.B, problem.pairs)
    rows, _ = equations(motion_g, motion_c)
    R, T = solution.X[:3, :3], solution.X[:3, 3]
    weights = row_weights(motion_g, motion_c)[..., None]
    residual = weights * _residual_jacobian(R, T, motion_g)
    moved = scaled_influence(weights * rows, R[None], residual)
    by_motions = np.concatenate([moved[:, 9:], 0.5 * by_turn(R).T @ moved[:, :9]], axis=1)
    return influence_from_motions(problem, solution, by_motions)


def _residual_jacobian(R: FloatArray, T: FloatArray, motion_g: FloatArray) -> FloatArray:
    """Return (m, 12, 12): the equations at X by the perturbations of H_gij and H_cij."""
    residual = np.zeros((len(motion_g), 12, 12))
    residual[:, :9, 3:6], residual[:, :9, 9:] = -by_turn(R), by_turn(R) @ R
    residual[:, 9:, :3], residual[:, 9:, 6:9] = -np.eye(3), R
    residual[:, 9:, 3:6] = rotations.skew(motion_g[:, :3, :3] @ T)
    return residual
