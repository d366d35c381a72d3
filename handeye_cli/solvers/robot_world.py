"""The loop as `A_i X = Z B_i^-1`, for the methods that solve both unknown poses together.

These methods work on the stations themselves; interstation pairs only serve the rough rotation. The
unknowns stand in the order: elements of R_X, elements of R_Z, t_X, t_Z.
"""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry import rotations, se3
from handeye_cli.solvers.kronecker import by_turn, kron
from handeye_cli.solvers.motions import interstation_motions
from handeye_cli.solvers.problem import FloatArray, Problem, Solution
from handeye_cli.solvers.signs import rough_rotation


def equations(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """Return the (..., N, 12, 24) equations and the (..., N, 12) right-hand sides.

    The first nine of a station say `R_A R_X = R_Z R_Q`, the last three
    `R_Z t_Q + t_Z - R_A t_X = t_A`, with Q = B^-1.
    """
    A, Q = problem.A, se3.inverse(problem.B)
    R_A, t_Q, one = A[..., :3, :3], Q[..., :3, 3], np.eye(3)
    rows, right = np.zeros((*A.shape[:-2], 12, 24)), np.zeros((*A.shape[:-2], 12))
    rows[..., :9, :9] = kron(R_A, one)
    rows[..., :9, 9:18] = -kron(one, np.swapaxes(Q[..., :3, :3], -1, -2))
    rows[..., 9:, 9:18] = np.einsum("ij,...k->...ijk", one, t_Q).reshape(*t_Q.shape, 9)
    rows[..., 9:, 18:21], rows[..., 9:, 21:] = -R_A, one
    right[..., 9:] = A[..., :3, 3]
    return rows, right


def rough_rotations(problem: Problem) -> FloatArray:
    """Return the (..., 2, 3, 3) rough rotations of X and Z."""
    R_X = rough_rotation(*interstation_motions(problem.A, problem.B, problem.pairs))
    R_A, R_B = problem.A[..., :3, :3], problem.B[..., :3, :3]
    return np.stack([R_X, rotations.mean(R_A @ R_X[..., None, :, :] @ R_B)], axis=-3)


def rotations_of(solution: Solution) -> FloatArray:
    """Return the (2, 3, 3) rotations of X and Z."""
    return np.stack([solution.X[:3, :3], solution.Z[:3, :3]])


def solution_of(R: FloatArray, t: FloatArray) -> Solution:
    """Return X and Z of their (..., 2, 3, 3) rotations and (..., 2, 3) translations."""
    both = se3.from_parts(R, t)
    return Solution(X=both[..., 0, :, :], Z=both[..., 1, :, :])


def residual_jacobian(problem: Problem, solution: Solution) -> FloatArray:
    """Return (N, 12, 12): the equations at the solution by the perturbations of A_i and B_i."""
    A, Q = problem.A, se3.inverse(problem.B)
    R_Z, carried = solution.Z[:3, :3], A[:, :3, :3] @ solution.X[:3]
    residual = np.zeros((len(A), 12, 12))
    residual[:, :9, 3:6] = by_turn(carried[..., :3])
    residual[:, 9:, 3:6] = rotations.skew(carried[..., 3])
    residual[:, 9:, :3] = -np.eye(3)
    residual[:, :9, 9:] = -by_turn(R_Z @ Q[:, :3, :3]) @ R_Z
    residual[:, 9:, 6:9] = R_Z
    residual[:, :, 6:] = residual[:, :, 6:] @ se3.inverse_jacobian(problem.B)
    return residual


def rotation_turns(solution: Solution) -> FloatArray:
    """Return the (18, 6) derivative of the rotations' elements by the turns of X and Z."""
    turns = np.zeros((18, 6))
    turns[:9, :3], turns[9:, 3:] = by_turn(rotations_of(solution))
    return turns


def influence_of(turns: FloatArray, shifts: FloatArray) -> FloatArray:
    """Return the (N, 12, 12) influence in the order of perturbations.

    Args:
        turns: (N, 6, 12) how the rotations of X and Z move.
        shifts: (N, 6, 12) how their translations move.
    """
    parts = [shifts[:, :3], turns[:, :3], shifts[:, 3:], turns[:, 3:]]
    return np.concatenate(parts, axis=1)
