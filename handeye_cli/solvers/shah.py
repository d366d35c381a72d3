"""Shah 2013: both rotations of `A X = Z B` by the Kronecker product, then both translations.

The rotations are the null vector of homogeneous equations in the elements of both - the singular
vectors of `sum kron(R_A, R_B)` - and the translations follow by linear least squares. A is the
robot's pose and B the inverse of the camera's: the residuals are in the reference frame, where
their lever is the camera's distance from the target and not the robot's reach.

M. Shah, "Solving the robot-world/hand-eye calibration problem using the Kronecker product",
J. Mechanisms and Robotics 5(3), 2013.
"""

from __future__ import annotations

import numpy as np

from handeye_cli.solvers import robot_world
from handeye_cli.solvers.kronecker import null_rotations, scaled_influence
from handeye_cli.solvers.problem import FloatArray, Problem, Solution


def solve(problem: Problem) -> Solution:
    """Solve for X = mount_T_camera and Z = reference_T_target together.

    Args:
        problem: Stations; at least three, with two different axes between them.
    """
    rows, right = robot_world.equations(problem)
    R = null_rotations(rows[..., :9, :18], robot_world.rough_rotations(problem))
    carried = rows[..., 9:, :18] @ R.reshape(*R.shape[:-3], 1, 18, 1)
    left = right[..., 9:] - carried[..., 0]
    t = _back(rows) @ left.reshape(*left.shape[:-2], -1, 1)
    return robot_world.solution_of(R, t.reshape(*t.shape[:-2], 2, 3))


def _back(rows: FloatArray) -> FloatArray:
    """Return the (..., 6, 3 N) pseudo-inverse of the equations for the translations."""
    flat = rows[..., 9:, 18:].reshape(*rows.shape[:-3], -1, 6)
    return np.asarray(np.linalg.pinv(flat))


def influence(problem: Problem, solution: Solution) -> FloatArray:
    """Return how X and Z move with each station's poses, to first order.

    Args:
        problem: Stations without leading axes.
        solution: Its solution.

    Returns:
        (N, 12, 12): rows are the perturbations of X and Z, columns those of A_i and B_i.
    """
    rows, _ = robot_world.equations(problem)
    residual = robot_world.residual_jacobian(problem, solution)
    R = robot_world.rotations_of(solution)
    by_turns = robot_world.rotation_turns(solution)
    turns = 0.5 * by_turns.T @ scaled_influence(rows[:, :9, :18], R, residual[:, :9])
    back = _back(rows).reshape(6, -1, 3)
    by_rotations = np.einsum("imk,mkl->il", back, rows[:, 9:, :18] @ by_turns)
    shifts = -np.einsum("imk,mkl->mil", back, residual[:, 9:]) - by_rotations @ turns
    return robot_world.influence_of(turns, shifts)
