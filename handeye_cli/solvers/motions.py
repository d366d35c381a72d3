"""Interstation motions, the data of every method for `H_g X = X H_c`, and their derivatives."""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry import se3
from handeye_cli.solvers.problem import FloatArray, IntArray, Problem, Solution
from handeye_cli.solvers.station_mean import mean_influence


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


def influence_from_motions(
    problem: Problem, solution: Solution, by_motions: FloatArray
) -> FloatArray:
    """Carry the influence of motions over to the stations; Z is their mean.

    Args:
        problem: Stations without leading axes.
        solution: Its solution.
        by_motions: (m, 6, 12) how X moves with the perturbations of H_gij and H_cij.

    Returns:
        (N, 12, 12): rows are the perturbations of X and Z, columns those of A_i and B_i.
    """
    by_first, by_second = _motion_jacobians(problem)
    total = np.zeros((len(problem.A), 6, 12))
    np.add.at(total, problem.pairs[:, 0], by_motions @ by_first)
    np.add.at(total, problem.pairs[:, 1], by_motions @ by_second)
    target = mean_influence(problem.A, problem.B, solution.X, total)
    return np.concatenate([total, target], axis=1)


def _motion_jacobians(problem: Problem) -> tuple[FloatArray, FloatArray]:
    """Return (m, 12, 12): the motions of a pair by the poses of its first and second station."""
    i, j = problem.pairs[:, 0], problem.pairs[:, 1]
    A_i, A_j, B_i, B_j = problem.A[i], problem.A[j], problem.B[i], problem.B[j]
    first, second = np.zeros((2, len(i), 12, 12))
    by_inverse, first[:, :6, :6] = se3.compose_jacobians(se3.inverse(A_j), A_i)
    second[:, :6, :6] = by_inverse @ se3.inverse_jacobian(A_j)
    second[:, 6:, 6:], by_inverse = se3.compose_jacobians(B_j, se3.inverse(B_i))
    first[:, 6:, 6:] = by_inverse @ se3.inverse_jacobian(B_i)
    return first, second
