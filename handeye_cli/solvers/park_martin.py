"""Park and Martin 1994: R_cg from the logarithms of the motions' rotations, then T_cg.

`H_g X = X H_c` carries the logarithm of the camera's rotation onto that of the mount's by R_cg, and
the rotation that does so with least squares is known in closed form. A motion weighs with its
angle. Where the paper's `(M' M)^(-1/2) M'` loses rank, for axes in one plane, the rotation nearest
to M' takes its place.

F. C. Park and B. J. Martin, "Robot sensor calibration: solving AX = XB on the Euclidean group",
IEEE Trans. Robotics and Automation 10(5), 1994.
"""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry import rotations, se3
from handeye_cli.solvers.alignment import align_axes, alignment_influence
from handeye_cli.solvers.motions import influence_from_motions, interstation_motions
from handeye_cli.solvers.problem import FloatArray, Problem, Solution
from handeye_cli.solvers.signs import signed_quaternions
from handeye_cli.solvers.station_mean import mean_target
from handeye_cli.solvers.translation import separable_influence, solve_translation


def solve(problem: Problem) -> Solution:
    """Solve for X = mount_T_camera from the motions, and for Z as the mean over the stations.

    Args:
        problem: Stations and pairs; at least two pairs with different axes.
    """
    motion_g, motion_c = interstation_motions(problem.A, problem.B, problem.pairs)
    R = align_axes(*_logarithms(motion_g, motion_c))
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
    log_g, log_c = _logarithms(motion_g, motion_c)
    by_turn_g, by_turn_c = (rotations.left_jacobian_inverse(log) for log in (log_g, log_c))
    rotation_row = alignment_influence(solution.X[:3, :3], log_c, by_turn_g, by_turn_c)
    by_motions = separable_influence(solution.X, motion_g, motion_c, rotation_row)
    return influence_from_motions(problem, solution, by_motions)


def _logarithms(motion_g: FloatArray, motion_c: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (..., m, 3) rotation vectors of both sides, with axes of matching signs.

    A camera's quaternion whose sign was turned has w < 0: its angle is then just above pi.
    """
    _, q_c, _ = signed_quaternions(motion_g, motion_c)
    log_g, log_c = rotations.log(motion_g[..., :3, :3]), rotations.log(motion_c[..., :3, :3])
    length = np.linalg.norm(log_c, axis=-1, keepdims=True)
    beyond = (1.0 - 2.0 * np.pi / np.where(length > 0.0, length, 1.0)) * log_c
    turned = np.sum(q_c[..., :3] * log_c, axis=-1, keepdims=True) < 0.0
    return log_g, np.where(turned, beyond, log_c)
