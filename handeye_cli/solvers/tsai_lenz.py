"""The paper's closed form, eq. (9)-(15): R_cg from the axes of motions, then T_cg.

Two exceptions of the paper are met without loss of accuracy. Eq. (12) is singular for a rotation
R_cg of pi: the gripper frame is first turned by a fixed half turn, chosen from the data, that
brings R_cg well away from pi, and turned back at the end. An interstation rotation near pi leaves
the sign of its axis open: the rough solution that the choice rests on settles it.
"""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry import rotations, se3
from handeye_cli.solvers.motions import influence_from_motions, interstation_motions
from handeye_cli.solvers.problem import FloatArray, Problem, Solution
from handeye_cli.solvers.signs import axis_jacobian, signed_quaternions
from handeye_cli.solvers.station_mean import mean_target
from handeye_cli.solvers.translation import least_squares, separable_influence, solve_translation

__all__ = ["axes_rotation", "influence", "interstation_motions", "solve"]

_HALF_TURNS = np.array([np.eye(3), *(2.0 * np.outer(e, e) - np.eye(3) for e in np.eye(3))])
"""The identity and the half turns about x, y and z."""
_LARGEST_PLAIN_ANGLE = 2.0 * np.pi / 3.0
"""Up to this angle of R_cg eq. (12) is used as it stands; some half turn always gets below it."""


def solve(problem: Problem) -> Solution:
    """Solve for X = mount_T_camera by eq. (12)-(15), and for Z as the mean over the stations.

    Args:
        problem: Stations and pairs; at least two pairs with different axes.
    """
    motion_g, motion_c = interstation_motions(problem.A, problem.B, problem.pairs)
    R = axes_rotation(*signed_quaternions(motion_g, motion_c))
    X = se3.from_parts(R, solve_translation(R, motion_g, motion_c))
    return Solution(X, mean_target(problem.A, problem.B, X))


def axes_rotation(
    q_g: FloatArray,
    q_c: FloatArray,
    rough: FloatArray,
    largest_plain_angle: float = _LARGEST_PLAIN_ANGLE,
) -> FloatArray:
    """Return R_cg by eq. (12); (13) and (14) are its quaternion (P', 1) in other words.

    Args:
        q_g: (..., m, 4) quaternions of the mount's motions.
        q_c: (..., m, 4) those of the camera's, with matching signs.
        rough: (..., 3, 3) rough R_cg.
        largest_plain_angle: Angle of R_cg in radians beyond which the mount's frame is turned.

    Returns:
        (..., 3, 3) rotations.
    """
    Q = _pre_rotation(rough, largest_plain_angle)
    P_g, P_c = 2.0 * q_g[..., :3] @ np.swapaxes(Q, -1, -2), 2.0 * q_c[..., :3]
    P_prime = least_squares(rotations.skew(P_g + P_c), P_c - P_g)
    one = np.ones((*P_prime.shape[:-1], 1))
    turned = rotations.matrix_from_quaternion(np.concatenate([P_prime, one], axis=-1))
    return np.asarray(np.swapaxes(Q, -1, -2) @ turned)


def _pre_rotation(rough: FloatArray, largest_plain_angle: float) -> FloatArray:
    """Return the half turn Q, or none, that takes `Q R_cg` away from pi."""
    angles = rotations.angle(_HALF_TURNS @ rough[..., None, :, :])
    best = np.where(angles[..., 0] <= largest_plain_angle, 0, np.argmin(angles, axis=-1))
    return _HALF_TURNS[best]


def influence(problem: Problem, solution: Solution) -> FloatArray:
    """Return how X and Z move with each station's poses, to first order.

    Eq. (12) and (15) are linear least squares whose residuals vanish for perfect data, so the
    solution moves by the pseudo-inverse times the change of the residuals. Eq. (15) also moves
    with R_cg.

    Args:
        problem: Stations without leading axes.
        solution: Its solution.

    Returns:
        (N, 12, 12): rows are the perturbations of X and Z, columns those of A_i and B_i.
    """
    motion_g, motion_c = interstation_motions(problem.A, problem.B, problem.pairs)
    rotation_row = _rotation_influence(solution.X[:3, :3], motion_g, motion_c)
    by_motions = separable_influence(solution.X, motion_g, motion_c, rotation_row)
    return influence_from_motions(problem, solution, by_motions)


def _rotation_influence(R: FloatArray, motion_g: FloatArray, motion_c: FloatArray) -> FloatArray:
    """Return (m, 3, 12): the perturbation of R_cg by those of H_gij and H_cij."""
    q_g, q_c, rough = signed_quaternions(motion_g, motion_c)
    Q = _pre_rotation(rough, _LARGEST_PLAIN_ANGLE)
    half = rotations.quaternion_from_matrix(Q @ R)
    P_prime = half[:3] / half[3]
    residual = np.zeros((len(q_g), 3, 12))
    by_g, by_c = np.eye(3) - rotations.skew(P_prime), -np.eye(3) - rotations.skew(P_prime)
    residual[:, :, 3:6] = 2.0 * by_g @ Q @ axis_jacobian(q_g)
    residual[:, :, 9:] = 2.0 * by_c @ axis_jacobian(q_c)
    rows = rotations.skew(2.0 * (q_g[:, :3] @ Q.T + q_c[:, :3]))
    back = np.linalg.pinv(rows.reshape(-1, 3)).reshape(3, -1, 3)
    to_turn = (np.eye(3) + rotations.skew(P_prime)) * (2.0 / (1.0 + P_prime @ P_prime))
    return np.asarray(-np.einsum("ij,jmk,mkl->mil", Q.T @ to_turn, back, residual))
