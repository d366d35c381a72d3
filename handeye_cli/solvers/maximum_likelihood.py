"""The answer at the Cramer-Rao bound: both poses of every station are uncertain.

To first order the residual of a station's loop has the covariance
`S_i = G_i S_robot G_i' + B_i S_camera,i B_i'`; `sum e_i' S_i^-1 e_i` is minimised over X and Z by
Gauss-Newton steps, started from the closed form, in O(N).
"""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry import se3
from handeye_cli.geometry.loop import LoopJacobians, loop_jacobians
from handeye_cli.geometry.scaled_inverse import scaled_inverse
from handeye_cli.solvers import tsai_lenz
from handeye_cli.solvers.problem import FloatArray, Problem, Solution

_MAX_STEPS = 50
_TOLERANCE = 1e-10
"""Largest step, in standard deviations of the unknowns, at which the iteration has settled."""


def solve(problem: Problem) -> Solution:
    """Minimise the weighted squares of the loop's residuals over X and Z.

    Args:
        problem: Stations with their covariances.

    Returns:
        The solution; `converged` tells whether every trial settled.
    """
    start = tsai_lenz.solve(problem)
    X, Z = start.X, start.Z
    for _ in range(_MAX_STEPS):
        loop = loop_jacobians(problem.A, problem.B, X, Z)
        information, weighted = _normal_equations(problem, loop)
        gradient = np.einsum("...nij,...nj->...i", weighted, loop.residuals)
        step = -_solve_scaled(information, gradient)
        X, Z = se3.perturb(X, step[..., :6]), se3.perturb(Z, step[..., 6:])
        length = np.einsum("...i,...ij,...j->...", step, information, step)
        if np.all(length < _TOLERANCE**2) or np.all(np.abs(step) < 1e-13):
            return Solution(X, Z)
    return Solution(X, Z, converged=bool(np.all(length < 1e-6)))


def _normal_equations(problem: Problem, loop: LoopJacobians) -> tuple[FloatArray, FloatArray]:
    """Return the (..., 12, 12) information and the (..., N, 12, 6) weighted derivatives."""
    weight = np.linalg.inv(loop_covariance(problem, loop))
    J = loop.by_unknowns
    weighted = np.swapaxes(J, -1, -2) @ weight
    return np.einsum("...nij,...njk->...ik", weighted, J), weighted


def loop_covariance(problem: Problem, loop: LoopJacobians) -> FloatArray:
    """Return the (..., N, 6, 6) covariances S_i of the loop's residuals."""
    by_poses = loop.by_poses
    return np.asarray(by_poses @ problem.covariance @ np.swapaxes(by_poses, -1, -2))


def _solve_scaled(information: FloatArray, gradient: FloatArray) -> FloatArray:
    """Solve with unit diagonal, so metres and radians do not spoil the conditioning."""
    scale = 1.0 / np.sqrt(np.einsum("...ii->...i", information))
    scaled = scale[..., :, None] * information * scale[..., None, :]
    return np.asarray(scale * np.linalg.solve(scaled, (scale * gradient)[..., None])[..., 0])


def influence(problem: Problem, solution: Solution) -> FloatArray:
    """Return how X and Z move with each station's poses, to first order.

    Args:
        problem: Stations without leading axes.
        solution: Its solution.

    Returns:
        (N, 12, 12): rows are the perturbations of X and Z, columns those of A_i and B_i.
    """
    loop = loop_jacobians(problem.A, problem.B, solution.X, solution.Z)
    information, weighted = _normal_equations(problem, loop)
    return np.asarray(-scaled_inverse(information) @ weighted @ loop.by_poses)
