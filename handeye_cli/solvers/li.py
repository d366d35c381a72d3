"""Li, Wang and Wu 2010: both poses of `A X = Z B` at once, by linear equations.

Rotation and translation equations of all stations make one linear system in 24 unknowns. The factor
of the rotations' elements, which the method leaves to the translations, is fixed to that of
rotations, and the equations are weighed so that the unit of length does not matter: `kronecker`.

A. Li, L. Wang and D. Wu, "Simultaneous robot-world and hand-eye calibration using dual-quaternions
and Kronecker product", Int. J. Physical Sciences 5(10), 2010.
"""

from __future__ import annotations

from handeye_cli.geometry import rotations
from handeye_cli.solvers import robot_world
from handeye_cli.solvers.kronecker import (
    null_rotations,
    row_weights,
    scaled_influence,
    solve_scaled,
)
from handeye_cli.solvers.motions import interstation_motions
from handeye_cli.solvers.problem import FloatArray, Problem, Solution


def solve(problem: Problem) -> Solution:
    """Solve for X = mount_T_camera and Z = reference_T_target together.

    Args:
        problem: Stations; at least three, with two different axes between them.
    """
    rows, right = robot_world.equations(problem)
    R = null_rotations(rows[..., :9, :18], robot_world.rough_rotations(problem))
    weights = _weights(problem)
    return solution_of(solve_scaled(weights[..., None] * rows, weights * right, R))


def _weights(problem: Problem) -> FloatArray:
    """Return the (..., 1, 12) weights of a station's equations."""
    return row_weights(*interstation_motions(problem.A, problem.B, problem.pairs))


def solution_of(unknowns: FloatArray) -> Solution:
    """Return X and Z of (..., 24) unknowns, with the nearest rotations."""
    elements = unknowns[..., :18].reshape(*unknowns.shape[:-1], 2, 3, 3)
    shifts = unknowns[..., 18:].reshape(*unknowns.shape[:-1], 2, 3)
    return robot_world.solution_of(rotations.project_to_so3(elements), shifts)


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
    weights = _weights(problem)[..., None]
    moved = scaled_influence(weights * rows, robot_world.rotations_of(solution), weights * residual)
    turns = 0.5 * robot_world.rotation_turns(solution).T @ moved[:, :18]
    return robot_world.influence_of(turns, moved[:, 18:])
