"""Horaud and Dornaika 1995: R_cg by quaternions in closed form, then T_cg.

The rotation minimises `sum |q_g * q - q * q_c|^2` over unit quaternions q. The scalar parts of q_g
and q_c add a constant only, so q is the eigenvector of a 4x4 matrix built from the vector parts -
the same optimum as the rotation that carries the camera's vector parts onto the mount's, which is
how it is computed here. A motion weighs with the sine of half its angle.

R. Horaud and F. Dornaika, "Hand-eye calibration", Int. J. Robotics Research 14(3), 1995.
"""

from __future__ import annotations

from handeye_cli.geometry import se3
from handeye_cli.solvers.alignment import align_axes, alignment_influence
from handeye_cli.solvers.motions import influence_from_motions, interstation_motions
from handeye_cli.solvers.problem import FloatArray, Problem, Solution
from handeye_cli.solvers.signs import axis_jacobian, signed_quaternions
from handeye_cli.solvers.station_mean import mean_target
from handeye_cli.solvers.translation import separable_influence, solve_translation


def solve(problem: Problem) -> Solution:
    """Solve for X = mount_T_camera from the motions, and for Z as the mean over the stations.

    Args:
        problem: Stations and pairs; at least two pairs with different axes.
    """
    motion_g, motion_c = interstation_motions(problem.A, problem.B, problem.pairs)
    q_g, q_c, _ = signed_quaternions(motion_g, motion_c)
    R = align_axes(q_g[..., :3], q_c[..., :3])
    X = se3.from_parts(R, solve_translation(R, motion_g, motion_c))
    return Solution(X, mean_target(problem.A, problem.B, X))


def influence(problem: Problem, solution: Solution) -> FloatArray:
    """Return how X and Z move with each station's poses, to first order.

    Args:
        problem: Stations without leading axes.
        solution: Its solution.

    Returns:
        (N, 12, 12): rows are the perturbations of X and Z, columns those of A_i and B_i.
    """
    motion_g, motion_c = interstation_motions(problem.A, problem.B, problem.pairs)
    q_g, q_c, _ = signed_quaternions(motion_g, motion_c)
    rotation_row = alignment_influence(
        solution.X[:3, :3], q_c[:, :3], axis_jacobian(q_g), axis_jacobian(q_c)
    )
    by_motions = separable_influence(solution.X, motion_g, motion_c, rotation_row)
    return influence_from_motions(problem, solution, by_motions)
