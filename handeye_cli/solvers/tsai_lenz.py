"""The paper's closed form, eq. (9)-(15): R_cg from the axes of motions, then T_cg.

Two exceptions of the paper are met without loss of accuracy. Eq. (12) is singular for a rotation
R_cg of pi: the gripper frame is first turned by a fixed half turn, chosen from the data, that
brings R_cg well away from pi, and turned back at the end. An interstation rotation near pi leaves
the sign of its axis open: the rough solution that the choice rests on settles it.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from handeye_cli.geometry import rotations, se3
from handeye_cli.solvers.problem import FloatArray, IntArray, Problem, Solution
from handeye_cli.solvers.station_mean import mean_influence, mean_target

_HALF_TURNS = np.array([np.eye(3), *(2.0 * np.outer(e, e) - np.eye(3) for e in np.eye(3))])
"""The identity and the half turns about x, y and z."""
_NEAR_PI = 1.98
"""Length of the axis 2 sin(angle / 2) above which its sign is taken from the rough solution."""
_LARGEST_PLAIN_ANGLE = 2.0 * np.pi / 3.0
"""Up to this angle of R_cg eq. (12) is used as it stands; some half turn always gets below it."""


def solve(problem: Problem) -> Solution:
    """Solve for X = mount_T_camera by eq. (12)-(15), and for Z as the mean over the stations.

    Args:
        problem: Stations and pairs; at least two pairs with different axes.
    """
    motion_g, motion_c = interstation_motions(problem.A, problem.B, problem.pairs)
    axes = _signed_axes(motion_g, motion_c)
    R = _rotation(*axes)
    rows, right = _translation_system(R, motion_g, motion_c)
    X = se3.from_parts(R, _least_squares(rows, right))
    return Solution(X, mean_target(problem.A, problem.B, X))


def interstation_motions(
    A: FloatArray, B: FloatArray, pairs: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Return H_gij = H_gj^-1 H_gi and H_cij = H_cj H_ci^-1, eq. (6) and (7).

    Args:
        A: (..., N, 4, 4) robot poses H_gi.
        B: (..., N, 4, 4) camera extrinsics H_ci.
        pairs: (m, 2) indices i, j.

    Returns:
        Two (..., m, 4, 4) arrays, with `H_gij X = X H_cij`.
    """
    i, j = pairs[:, 0], pairs[:, 1]
    motion_g = se3.inverse(A[..., j, :, :]) @ A[..., i, :, :]
    return motion_g, B[..., j, :, :] @ se3.inverse(B[..., i, :, :])


def _signed_axes(
    motion_g: FloatArray, motion_c: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return P_g and P_c of eq. (9) with matching signs, and the rough rotation behind them."""
    P_g = rotations.principal_axis(motion_g[..., :3, :3])
    P_c = rotations.principal_axis(motion_c[..., :3, :3])
    rough = _rough_rotation(P_g, P_c, motion_g, motion_c)
    carried = P_c @ np.swapaxes(rough, -1, -2)
    opposite = np.sum(carried * P_g, axis=-1) < 0
    near_pi = np.linalg.norm(P_g, axis=-1) > _NEAR_PI
    return P_g, np.where((opposite & near_pi)[..., None], -P_c, P_c), rough


def _rough_rotation(
    P_g: FloatArray, P_c: FloatArray, motion_g: FloatArray, motion_c: FloatArray
) -> FloatArray:
    """Return R_cg from the two most different axes, with the signs that fit all motions best.

    Half turns about perpendicular axes leave four rotations that fit all rotations alike; then the
    one that fits the translations is taken.
    """
    first = np.argmax(np.linalg.norm(P_g, axis=-1), axis=-1)[..., None, None]
    area = np.linalg.norm(np.cross(P_g, np.take_along_axis(P_g, first, axis=-2)), axis=-1)
    second = np.argmax(area, axis=-1)[..., None, None]
    index = np.concatenate([first, second], axis=-2)
    a, b = np.take_along_axis(P_g, index, axis=-2), np.take_along_axis(P_c, index, axis=-2)
    signs = np.array(list(product((1.0, -1.0), repeat=2)))
    R = rotations.align(a[..., None, :, :], signs[..., None] * b[..., None, :, :])
    turn = motion_g[..., None, :, :3, :3] @ R[..., None, :, :]
    turn = turn - R[..., None, :, :] @ motion_c[..., None, :, :3, :3]
    misfit = np.sum(turn**2, axis=(-3, -2, -1))
    rows, right = _translation_system(R, motion_g[..., None, :, :, :], motion_c[..., None, :, :, :])
    flat = right.reshape(*right.shape[:-2], -1)
    left = flat - (rows.reshape(*flat.shape, 3) @ _least_squares(rows, right)[..., None])[..., 0]
    best = np.min(misfit, axis=-1, keepdims=True)
    possible = misfit <= 4.0 * best + 1e-9 * motion_g.shape[-3]
    cost = np.where(possible, np.sum(left**2, axis=-1), np.inf)
    chosen = np.argmin(cost, axis=-1)[..., None, None, None]
    return np.take_along_axis(R, chosen, axis=-3)[..., 0, :, :]


def _pre_rotation(rough: FloatArray) -> FloatArray:
    """Return the half turn Q, or none, that takes `Q R_cg` away from pi."""
    angles = rotations.angle(_HALF_TURNS @ rough[..., None, :, :])
    best = np.where(angles[..., 0] <= _LARGEST_PLAIN_ANGLE, 0, np.argmin(angles, axis=-1))
    return _HALF_TURNS[best]


def _rotation(P_g: FloatArray, P_c: FloatArray, rough: FloatArray) -> FloatArray:
    """Return R_cg by eq. (12); (13) and (14) are its quaternion (P', 1) in other words."""
    Q = _pre_rotation(rough)
    P_g = P_g @ np.swapaxes(Q, -1, -2)
    P_prime = _least_squares(rotations.skew(P_g + P_c), P_c - P_g)
    one = np.ones((*P_prime.shape[:-1], 1))
    turned = rotations.matrix_from_quaternion(np.concatenate([P_prime, one], axis=-1))
    return np.asarray(np.swapaxes(Q, -1, -2) @ turned)


def _translation_system(
    R: FloatArray, motion_g: FloatArray, motion_c: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the (..., m, 3, 3) matrices and (..., m, 3) right-hand sides of eq. (15)."""
    carried = motion_c[..., :3, 3] @ np.swapaxes(R, -1, -2)
    rows = np.broadcast_to(motion_g[..., :3, :3] - np.eye(3), (*carried.shape, 3))
    return rows, carried - motion_g[..., :3, 3]


def _least_squares(rows: FloatArray, right: FloatArray) -> FloatArray:
    """Solve (..., m, 3, 3) blocks of equations with (..., m, 3) right-hand sides together."""
    matrix = rows.reshape(*rows.shape[:-3], -1, 3)
    vector = right.reshape(*right.shape[:-2], -1, 1)
    return (np.linalg.pinv(matrix) @ vector)[..., 0]


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
    by_first, by_second = _motion_jacobians(problem, motion_g, motion_c)
    rotation_row = _rotation_influence(solution.X[:3, :3], motion_g, motion_c)
    translation_row = _translation_influence(solution.X, motion_g, motion_c, rotation_row)
    answer = np.concatenate([translation_row, rotation_row], axis=-2)
    total = np.zeros((len(problem.A), 6, 12))
    np.add.at(total, problem.pairs[:, 0], answer @ by_first)
    np.add.at(total, problem.pairs[:, 1], answer @ by_second)
    target = mean_influence(problem.A, problem.B, solution.X, total)
    return np.concatenate([total, target], axis=1)


def _motion_jacobians(
    problem: Problem, motion_g: FloatArray, motion_c: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return (m, 12, 12): the motions of a pair by the poses of its first and second station."""
    i, j = problem.pairs[:, 0], problem.pairs[:, 1]
    A_i, A_j, B_i, B_j = problem.A[i], problem.A[j], problem.B[i], problem.B[j]
    first, second = np.zeros((2, len(i), 12, 12))
    by_inverse, first[:, :6, :6] = se3.compose_jacobians(se3.inverse(A_j), A_i)
    second[:, :6, :6] = by_inverse @ se3.inverse_jacobian(A_j)
    second[:, 6:, 6:], by_inverse = se3.compose_jacobians(B_j, se3.inverse(B_i))
    first[:, 6:, 6:] = by_inverse @ se3.inverse_jacobian(B_i)
    return first, second


def _rotation_influence(R: FloatArray, motion_g: FloatArray, motion_c: FloatArray) -> FloatArray:
    """Return (m, 3, 12): the perturbation of R_cg by those of H_gij and H_cij."""
    P_g, P_c, rough = _signed_axes(motion_g, motion_c)
    Q = _pre_rotation(rough)
    P_g = P_g @ Q.T
    half = rotations.quaternion_from_matrix(Q @ R)
    P_prime = half[:3] / half[3]
    residual = np.zeros((len(P_g), 3, 12))
    by_g, by_c = np.eye(3) - rotations.skew(P_prime), -np.eye(3) - rotations.skew(P_prime)
    residual[:, :, 3:6] = by_g @ _axis_jacobian(P_g) @ Q
    residual[:, :, 9:] = by_c @ _axis_jacobian(P_c)
    back = np.linalg.pinv(rotations.skew(P_g + P_c).reshape(-1, 3)).reshape(3, -1, 3)
    to_turn = (np.eye(3) + rotations.skew(P_prime)) * (2.0 / (1.0 + P_prime @ P_prime))
    return np.asarray(-np.einsum("ij,jmk,mkl->mil", Q.T @ to_turn, back, residual))


def _axis_jacobian(P: FloatArray) -> FloatArray:
    """Return dP of eq. (9) by a turn in the parent frame, for signed axes."""
    cosine = np.sqrt(np.maximum(1.0 - np.sum(P * P, axis=-1) / 4.0, 0.0))
    return np.asarray(cosine[..., None, None] * np.eye(3) - rotations.skew(P) / 2.0)


def _translation_influence(
    X: FloatArray, motion_g: FloatArray, motion_c: FloatArray, rotation_row: FloatArray
) -> FloatArray:
    """Return (m, 3, 12): the movement of T_cg with the perturbations of H_gij and H_cij."""
    R, T = X[:3, :3], X[:3, 3]
    rows, _ = _translation_system(R, motion_g, motion_c)
    back = np.linalg.pinv(rows.reshape(-1, 3)).reshape(3, -1, 3)
    residual = np.zeros((len(rows), 3, 12))
    residual[:, :, :3], residual[:, :, 6:9] = np.eye(3), -R
    residual[:, :, 3:6] = -rotations.skew(motion_g[:, :3, :3] @ T)
    by_turn = np.einsum("imk,mkl->il", back, rotations.skew(motion_c[:, :3, 3] @ R.T))
    return np.asarray(-np.einsum("imk,mkl->mil", back, residual) - by_turn @ rotation_row)
