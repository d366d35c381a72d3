"""OpenCV 4's estimators, in terms of the project's solvers.

The hand-eye methods use every pair of stations. Park, Horaud, Daniilidis and Shah are the project's
solvers as they are. The others differ:

- Tsai takes only the pairs whose axes of eq. (9) are between 0.3 and 1.7 long on both sides, and
  eq. (12) as it stands. That equation is singular for an answer of 180 degrees; within a
  degree of it the project's solver takes over, and all pairs are taken when fewer than two remain.
- Andreff and Li leave the factor of the rotations' elements to the translations. It is 1 for
  perfect data. Where it comes out below a half or above two, the translations did not determine it
  (all cameras look at the target's origin from one distance, for instance) and OpenCV's answer is
  wrong, or an error; then the project's solver, which fixes the factor, takes over.

OpenCV's Andreff, Daniilidis and Li weigh one radian like one unit of length, whatever that is.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from handeye_cli import solvers
from handeye_cli.compat.arguments import CalibrationError, FloatArray
from handeye_cli.geometry import observability, rotations, se3, star
from handeye_cli.solvers import Problem, Solution, andreff, li, tsai_lenz
from handeye_cli.solvers.kronecker import solve_free
from handeye_cli.solvers.motions import interstation_motions
from handeye_cli.solvers.robot_world import equations as robot_world_equations
from handeye_cli.solvers.signs import signed_quaternions
from handeye_cli.solvers.translation import solve_translation

IntArray = NDArray[np.int64]

_HAND_EYE = ("tsai-lenz", "park-martin", "horaud-dornaika", "andreff", "daniilidis")
_ROBOT_WORLD = ("shah", "li")
_SHORTEST_AXIS, _LONGEST_AXIS = 0.3, 1.7
_PLAIN_BELOW = np.pi - 0.02
"""Up to this angle of the answer eq. (12) stands noise of some milliradians."""
_LARGEST_SCALE = 2.0


def hand_eye(base_T_gripper: FloatArray, camera_T_target: FloatArray, method: int) -> FloatArray:
    """Return the (4, 4) gripper_T_camera by OpenCV's method of this number.

    Args:
        base_T_gripper: (N, 4, 4) robot poses.
        camera_T_target: (N, 4, 4) camera extrinsics.
        method: Number of the method, 0 to 4.

    Raises:
        CalibrationError: Unknown method, unequal or too few stations, or motions about one axis.
    """
    name = _name(method, _HAND_EYE)
    problem, motion_g, motion_c = _checked(base_T_gripper, camera_T_target, star.all_pairs)
    if name == "tsai-lenz":
        return _tsai(motion_g, motion_c)
    if name == "andreff":
        unknowns = solve_free(*andreff.equations(motion_g, motion_c))
        if _is_scaled(unknowns[:9]):
            return andreff.pose_of(unknowns)
    return solvers.load(name).solve(problem).X


def robot_world(camera_T_world: FloatArray, gripper_T_base: FloatArray, method: int) -> Solution:
    """Return world_T_base as X and camera_T_gripper as Z, by OpenCV's method of this number.

    OpenCV writes the loop as `camera_T_world X = Z gripper_T_base`: it minimises in the camera's
    frame, where the project's solvers, with both sides exchanged, would do so in the base's.

    Args:
        camera_T_world: (N, 4, 4) camera extrinsics.
        gripper_T_base: (N, 4, 4) inverses of the robot poses.
        method: Number of the method, 0 or 1.

    Raises:
        CalibrationError: Unknown method, unequal or too few stations, or motions about one axis.
    """
    name = _name(method, _ROBOT_WORLD)
    problem, _, _ = _checked(camera_T_world, se3.inverse(gripper_T_base), star.star_pairs)
    if name == "li":
        unknowns = solve_free(*robot_world_equations(problem))
        if _is_scaled(unknowns[:9]) and _is_scaled(unknowns[9:18]):
            return li.solution_of(unknowns)
    return solvers.load(name).solve(problem)


def _name(method: int, names: tuple[str, ...]) -> str:
    if method not in range(len(names)):
        known = ", ".join(f"{number} ({name})" for number, name in enumerate(names))
        raise CalibrationError(f"expected a method out of {known}, found {method!r}")
    return names[method]


def _checked(
    A: FloatArray, B: FloatArray, choose: Callable[[int], IntArray]
) -> tuple[Problem, FloatArray, FloatArray]:
    """Return the problem with the chosen pairs, and its motions."""
    if len(A) != len(B):
        raise CalibrationError(
            f"expected as many stations on both sides, found {len(A)} and {len(B)}"
        )
    if len(A) < 3:
        raise CalibrationError(f"expected at least 3 stations, found {len(A)}")
    pairs = choose(len(A))
    motions = interstation_motions(A, B, pairs)
    spread = observability.motion_spread(*motions)
    if spread.second_axis <= spread.mismatch:
        raise CalibrationError(
            "expected rotations about two different axes, found at most one: across the main axis "
            f"the stations turn by {np.degrees(spread.second_axis):.2g} deg, and the angles of "
            f"robot and camera differ by {np.degrees(spread.mismatch):.2g} deg",
            hint="add stations turned about another axis, by 20 deg or more",
        )
    return Problem(A, B, pairs, np.broadcast_to(np.eye(12), (len(A), 12, 12))), *motions


def _tsai(motion_g: FloatArray, motion_c: FloatArray) -> FloatArray:
    """Return gripper_T_camera by eq. (12) and (15) over the pairs that OpenCV takes."""
    lengths = np.stack(
        [
            np.linalg.norm(rotations.principal_axis(M[:, :3, :3]), axis=1)
            for M in (motion_g, motion_c)
        ]
    )
    taken = np.all((lengths > _SHORTEST_AXIS) & (lengths < _LONGEST_AXIS), axis=0)
    if np.count_nonzero(taken) >= 2:
        motion_g, motion_c = motion_g[taken], motion_c[taken]
    R = tsai_lenz.axes_rotation(
        *signed_quaternions(motion_g, motion_c), largest_plain_angle=_PLAIN_BELOW
    )
    return se3.from_parts(R, solve_translation(R, motion_g, motion_c))


def _is_scaled(elements: FloatArray) -> bool:
    """Tell whether nine elements have about the size of a rotation's."""
    scale = float(np.cbrt(np.linalg.det(elements.reshape(3, 3))))
    return 1.0 / _LARGEST_SCALE < scale < _LARGEST_SCALE
