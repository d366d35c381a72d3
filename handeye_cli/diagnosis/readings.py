"""The numbers of a stations document, and the poses they are when they are read in another way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.conventions import QuaternionOrder, RobotPoses, Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.records import FloatArray, IntArray, Stations


class EulerNumbers(NamedTuple):
    """Euler angles as they were written, of all stations alike.

    Attributes:
        values: (M, 3) numbers.
        order: Their axes as declared.
        degrees: Whether they were declared to be degrees.
    """

    values: FloatArray
    order: str
    degrees: bool


@dataclass(frozen=True)
class Reading:
    """The numbers as they were declared.

    Attributes:
        names: Of all M stations.
        index: (N,) stations with a target pose.
        robot: (M, 4, 4) robot poses as written, before they were turned to `base_T_gripper`.
        camera: (N, 4, 4) camera_T_target.
        setup: Where the camera was declared to be.
        inverted: Whether the robot's poses were declared base-in-gripper.
        quaternion_order: The declared order.
        euler: The robot's Euler angles, or None where it has none.
        from_pixels: Whether the target's poses were computed from pixels, and not declared.
    """

    names: tuple[str, ...]
    index: IntArray
    robot: FloatArray
    camera: FloatArray
    setup: Setup
    inverted: bool
    quaternion_order: QuaternionOrder
    euler: EulerNumbers | None
    from_pixels: bool

    def reference_T_mount(self, robot: FloatArray, *, inverted: bool) -> FloatArray:
        """Return the (..., 4, 4) poses of the loop for robot poses as written.

        Args:
            robot: (..., 4, 4) poses.
            inverted: Whether they are base-in-gripper.
        """
        turn_round = inverted is (self.setup is Setup.EYE_IN_HAND)
        return se3.inverse(robot) if turn_round else robot


def reading_of(stations: Stations, chain: Chain, most: int) -> Reading:
    """Return the numbers of a document, of at most `most` stations with a target pose.

    Args:
        stations: The document.
        chain: Its usable stations.
        most: Of more of them, as many are taken, evenly over the document.
    """
    count = len(chain.index)
    rows = np.linspace(0, count - 1, min(count, most)).round().astype(int)
    first = stations.stations[0].written
    inverted = first is not None and first.robot_poses is RobotPoses.BASE_IN_GRIPPER
    robot = np.array([station.base_T_gripper for station in stations.stations])
    return Reading(
        names=tuple(station.name for station in stations.stations),
        index=chain.index[rows],
        robot=se3.inverse(robot) if inverted else robot,
        camera=chain.B[rows],
        setup=stations.setup,
        inverted=inverted,
        quaternion_order=QuaternionOrder.XYZW if first is None else first.quaternion_order,
        euler=_euler(stations),
        from_pixels=all(stations.stations[index].observation for index in chain.index),
    )


def _euler(stations: Stations) -> EulerNumbers | None:
    """Return the Euler angles if all stations have them, with the same axes and unit."""
    written = [station.written for station in stations.stations]
    forms = {(each.order, each.degrees) for each in written if each and each.euler}
    values = [each.euler for each in written if each and each.euler]
    if len(values) < len(written) or len(forms) != 1:
        return None
    order, degrees = forms.pop()
    return EulerNumbers(np.array(values), order, degrees)


def with_other_quaternion_order(poses: FloatArray, declared: QuaternionOrder) -> FloatArray:
    """Return (..., 4, 4) poses as their quaternions are in the other order than declared.

    The numbers are those that the declared order turned into these rotations.
    """
    q = rotations.quaternion_from_matrix(poses[..., :3, :3])
    places = -1 if declared is QuaternionOrder.XYZW else 1
    R = rotations.matrix_from_quaternion(np.roll(q, places, axis=-1))
    return se3.from_parts(R, poses[..., :3, 3])
