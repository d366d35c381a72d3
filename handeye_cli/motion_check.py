"""Refuses data that do not determine the answer, and names what stays open.

Everything is judged against the noise that the data themselves show: the difference between the
robot's and the camera's rotation angles needs no solution.
"""

from __future__ import annotations

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.conventions import Setup
from handeye_cli.errors import UndeterminedError
from handeye_cli.geometry.observability import MotionSpread, motion_spread, nearest_axis
from handeye_cli.records import FloatArray, IntArray, PredictedError
from handeye_cli.solvers.tsai_lenz import interstation_motions

_SIGNIFICANCE = 4.0
"""A rotation has to exceed the noise by this factor to count."""
_CONTRADICTION = 0.1
"""Rotations of robot and camera that differ by more than this (radians) are not the same motion."""
_LARGEST_SIGMA = 0.35
"""A rotation less certain than this (radians) is not determined."""


def check_motions(chain: Chain, pairs: IntArray, setup: Setup) -> MotionSpread:
    """Check that the motions determine a rotation and a translation.

    Args:
        chain: The stations.
        pairs: (m, 2) interstation pairs.
        setup: Names the frame of the mount.

    Raises:
        UndeterminedError: The robot does not turn, turns about one axis only, or does not make the
            motions that the camera sees.
    """
    spread = motion_spread(*interstation_motions(chain.A, chain.B, pairs))
    noise = _SIGNIFICANCE * spread.mismatch
    frame = setup.mount
    if spread.median_mismatch > _CONTRADICTION:
        raise UndeterminedError(
            "expected the camera to turn by the same angles as the robot, found a median "
            f"difference of {np.degrees(spread.median_mismatch):.1f} deg between stations",
            hint="check that images and poses belong together, the Euler order and the "
            "quaternion order (--quaternion-order)",
        )
    if spread.largest_angle <= noise:
        raise UndeterminedError(
            "expected stations that differ in rotation, found a largest interstation angle of "
            f"{np.degrees(spread.largest_angle):.2g} deg at a noise of "
            f"{np.degrees(spread.mismatch):.2g} deg: the translation of {setup.answer} and its "
            "rotation are not determined",
            hint="add stations turned about two different axes, by 20 deg or more",
        )
    if spread.second_axis <= noise:
        raise UndeterminedError(
            f"expected rotations about two different axes, found only one: "
            f"{_axis_text(spread.main_axis, frame)}. The rotation of {setup.answer} about it and "
            "the translation along it are not determined",
            hint="add stations turned about another axis, by 20 deg or more",
        )
    return spread


def _axis_text(axis: FloatArray, frame: str) -> str:
    x, y, z = axis
    near = nearest_axis(axis)
    name = f", the {frame}'s {near} axis" if near else ""
    return f"({x:.2f}, {y:.2f}, {z:.2f}) in the {frame} frame{name}"


def check_answer(
    error: PredictedError, residuals: FloatArray, spread: MotionSpread, setup: Setup
) -> None:
    """Check that the answer means something: it is determined, and the stations agree on it.

    Args:
        error: The predicted error of the answer.
        residuals: (N, 6) residuals of the loop.
        spread: What `check_motions` measured.
        setup: Names the frame of the mount.

    Raises:
        UndeterminedError: The stations contradict each other, or the noise hides an axis.
    """
    typical = float(np.median(np.linalg.norm(residuals[:, 3:], axis=1)))
    if typical > _CONTRADICTION:
        raise UndeterminedError(
            f"expected all stations to see the target at one place, found them "
            f"{np.degrees(typical):.1f} deg apart in the median",
            hint="check --robot-poses (gripper-in-base or base-in-gripper), --quaternion-order and "
            "--setup",
        )
    if error.rotation > _LARGEST_SIGMA:
        raise UndeterminedError(
            f"the rotation of {setup.answer} is not determined: its predicted error is "
            f"{np.degrees(error.rotation):.0f} deg, because across the main axis "
            f"{_axis_text(spread.main_axis, setup.mount)} the stations turn little more than the "
            "noise",
            hint="add stations turned about another axis, by 20 deg or more",
        )
