"""Daniilidis 1999: rotation and translation together, as one unit dual quaternion.

With the dual quaternions a, b of both motions of a pair, `a q = q b` is linear in q. The six
equations of a motion, the scalar parts left out, leave a plane of solutions; in it the unit dual
quaternion is found by a quadratic equation. The dual parts carry the unit of length, so the answer
depends, within the noise, on whether lengths are given in metres or in millimetres.

K. Daniilidis, "Hand-eye calibration using dual quaternions", Int. J. Robotics Research 18(3), 1999.
"""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry import rotations, se3
from handeye_cli.solvers.motions import influence_from_motions, interstation_motions
from handeye_cli.solvers.problem import FloatArray, Problem, Solution
from handeye_cli.solvers.signs import axis_jacobian, signed_quaternions
from handeye_cli.solvers.station_mean import mean_target


def solve(problem: Problem) -> Solution:
    """Solve for X = mount_T_camera from the motions, and for Z as the mean over the stations.

    Args:
        problem: Stations and pairs; at least two pairs with different axes.
    """
    motion_g, motion_c = interstation_motions(problem.A, problem.B, problem.pairs)
    _, Vt = _singular_values(_equations(*_dual_quaternions(motion_g, motion_c)))
    q, dual = _unit_dual_quaternion(np.swapaxes(Vt[..., 6:, :], -1, -2))
    t = 2.0 * _vector_of_quotient(dual, q)
    X = se3.from_parts(rotations.matrix_from_quaternion(q), t)
    return Solution(X, mean_target(problem.A, problem.B, X))


def _dual_quaternions(motion_g: FloatArray, motion_c: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (..., m, 2, 4) real and dual parts (x y z w) of both motions."""
    q_g, q_c, _ = signed_quaternions(motion_g, motion_c)
    return _with_dual(q_g, motion_g[..., :3, 3]), _with_dual(q_c, motion_c[..., :3, 3])


def _with_dual(q: FloatArray, t: FloatArray) -> FloatArray:
    """Return q and its dual part `t q / 2`, stacked."""
    vector = q[..., 3:] * t + np.cross(t, q[..., :3])
    scalar = -np.sum(t * q[..., :3], axis=-1, keepdims=True)
    return np.stack([q, 0.5 * np.concatenate([vector, scalar], axis=-1)], axis=-2)


def _equations(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the (..., 6 m, 8) equations `vector(a q - q b) = 0` for q and its dual part."""
    total, apart = rotations.skew((a + b)[..., :3]), (a - b)[..., :3, None]
    blocks = np.concatenate([total, apart], axis=-1)
    T = np.zeros((*a.shape[:-2], 6, 8))
    T[..., :3, :4] = T[..., 3:, 4:] = blocks[..., 0, :, :]
    T[..., 3:, :4] = blocks[..., 1, :, :]
    return T.reshape(*T.shape[:-3], -1, 8)


def _singular_values(T: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (..., 8) singular values and the (..., 8, 8) right-hand vectors, as rows."""
    _, values, vectors = np.linalg.svd(np.asarray(np.linalg.qr(T, mode="r")))
    return values, vectors


def _unit_dual_quaternion(plane: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the unit dual quaternion in the span of two (..., 8, 2) columns.

    In the basis that makes the real parts orthogonal, the first column carries the rotation and
    the second next to none; `q . dual = 0` is quadratic in the share of the second, and its small
    root is the one that leaves a rotation.
    """
    _, turns = np.linalg.eigh(np.swapaxes(plane[..., :4, :], -1, -2) @ plane[..., :4, :])
    plane = plane @ turns[..., ::-1]
    product = np.swapaxes(plane[..., :4, :], -1, -2) @ plane[..., 4:, :]
    first, last = product[..., 0, 0], product[..., 1, 1]
    middle = 0.5 * (product[..., 0, 1] + product[..., 1, 0])
    root = np.sqrt(np.maximum(middle**2 - first * last, 0.0))
    share = -first / (middle + np.copysign(root, middle))
    both = plane[..., 0] + share[..., None] * plane[..., 1]
    both = both / np.linalg.norm(both[..., :4], axis=-1, keepdims=True)
    return both[..., :4], both[..., 4:]


def _vector_of_quotient(p: FloatArray, q: FloatArray) -> FloatArray:
    """Return the vector part of `p` times the conjugate of `q`."""
    return np.asarray(
        q[..., 3:] * p[..., :3] - p[..., 3:] * q[..., :3] - np.cross(p[..., :3], q[..., :3])
    )


def influence(problem: Problem, solution: Solution) -> FloatArray:
    """Return how X and Z move with each station's poses, to first order.

    The plane of solutions tilts by the pseudo-inverse of the equations times the change of their
    residuals; how q moves within the plane follows from its constraints.

    Args:
        problem: Stations without leading axes.
        solution: Its solution.

    Returns:
        (N, 12, 12): rows are the perturbations of X and Z, columns those of A_i and B_i.
    """
    motion_g, motion_c = interstation_motions(problem.A, problem.B, problem.pairs)
    a, b = _dual_quaternions(motion_g, motion_c)
    T = _equations(a, b)
    values, Vt = _singular_values(T)
    back = (Vt[:6].T / values[:6] ** 2) @ Vt[:6] @ T.T
    unit = _with_dual(rotations.quaternion_from_matrix(solution.X[:3, :3]), solution.X[:3, 3])
    residual = _residual_jacobian(unit, a, b, motion_g[:, :3, 3], motion_c[:, :3, 3])
    tilt = -np.einsum("imk,mkl->mil", back.reshape(8, -1, 6), residual)
    return influence_from_motions(problem, solution, _constrained(*unit) @ tilt)


def _residual_jacobian(
    unit: FloatArray, a: FloatArray, b: FloatArray, t_g: FloatArray, t_c: FloatArray
) -> FloatArray:
    """Return (m, 6, 12): the equations at the (2, 4) solution by the motions' perturbations.

    Columns are the perturbations of H_gij and H_cij, whose dual quaternions are a and b and whose
    translations are t_g and t_c.
    """
    residual = np.zeros((len(a), 6, 12))
    for sign, pair, t, columns in ((1.0, a, t_g, slice(0, 6)), (-1.0, b, t_c, slice(6, 12))):
        by_real, by_dual = _part_jacobians(pair, t)
        left, left_dual = (sign * p[3] * np.eye(3) - rotations.skew(p[:3]) for p in unit)
        residual[:, :3, columns] = left @ by_real
        residual[:, 3:, columns] = left_dual @ by_real + left @ by_dual
    return residual


def _part_jacobians(pair: FloatArray, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (m, 3, 6) derivatives of the vectors of the real and the dual part by a motion."""
    q = pair[:, 0]
    real, imaginary = np.zeros((2, len(q), 3, 6))
    real[:, :, 3:] = axis_jacobian(q)
    imaginary[:, :, :3] = axis_jacobian(q)
    by_scalar = -0.5 * t[:, :, None] * q[:, None, :3]
    imaginary[:, :, 3:] = 0.5 * (by_scalar + rotations.skew(t) @ real[:, :, 3:])
    return real, imaginary


def _constrained(q: FloatArray, dual: FloatArray) -> FloatArray:
    """Return (6, 8): the perturbation of X by a tilt of the plane, with q kept a unit.

    The plane is spanned by (q, dual) and (0, q); what a tilt does along these two is replaced by
    what `|q| = 1` and `q . dual = 0` demand.
    """
    length = q @ np.eye(8)[:4]
    real = np.eye(8)[:4] - np.outer(q, length)
    along = np.eye(8)[4:] - np.outer(dual, length)
    along = along - np.outer(q, q @ along + dual @ real)
    turn = 2.0 * _by_dividend(q) @ real
    shift = 2.0 * (_by_dividend(q) @ along - _by_dividend(dual) @ real)
    return np.concatenate([shift, turn])


def _by_dividend(q: FloatArray) -> FloatArray:
    """Return the (3, 4) derivative of `_vector_of_quotient` by its first argument."""
    return np.column_stack([q[3] * np.eye(3) + rotations.skew(q[:3]), -q[:3]])
