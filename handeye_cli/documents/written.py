"""How a robot's pose stood in the first document, carried along while poses are written anew.

Our documents write every pose as a quaternion. The numbers of Euler angles, and conventions other
than the defaults, would be lost on the way; but who wants to tell a wrong convention needs them.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from handeye_cli.conventions import QuaternionOrder, RobotPoses
from handeye_cli.documents.place import Place
from handeye_cli.documents.poses import PoseConventions, euler_angles
from handeye_cli.errors import InputError
from handeye_cli.geometry import rotations
from handeye_cli.records import FloatArray
from handeye_cli.records.line import WrittenRotation

_SAME = 1e-6
"""Angle in radians within which angles give a pose; rounding leaves far less."""
_OTHER_WAY_ROUND = {
    RobotPoses.GRIPPER_IN_BASE: RobotPoses.BASE_IN_GRIPPER,
    RobotPoses.BASE_IN_GRIPPER: RobotPoses.GRIPPER_IN_BASE,
}


def written_from_data(
    station: dict[str, Any], base_T_gripper: FloatArray, conventions: PoseConventions, place: Place
) -> WrittenRotation | None:
    """Return how a station's robot pose was written, or None for the default form.

    Args:
        station: The entry of the station.
        base_T_gripper: (4, 4) its pose as it was read.
        conventions: How the document writes poses.
        place: Where the entry stands.

    Raises:
        InputError: The entry's `written` is not how this pose was written.
    """
    pose, earlier = station["base_T_gripper"], station.get("written")
    if earlier is None:
        written = _written(pose, conventions.robot_poses, conventions.quaternion_order)
        return None if written == WrittenRotation() else written
    robot_poses = RobotPoses(earlier.get("robot_poses", RobotPoses.GRIPPER_IN_BASE))
    if conventions.robot_poses is RobotPoses.BASE_IN_GRIPPER:
        robot_poses = _OTHER_WAY_ROUND[robot_poses]
    order = QuaternionOrder(earlier.get("quaternion_order", QuaternionOrder.XYZW))
    written = _written(earlier, robot_poses, order)
    _require_same(written, base_T_gripper, place.key("written"))
    return written


def _written(
    data: dict[str, Any], robot_poses: RobotPoses, quaternion_order: QuaternionOrder
) -> WrittenRotation:
    if "euler" not in data:
        return WrittenRotation(robot_poses, quaternion_order)
    first, second, third = (float(angle) for angle in data["euler"])
    return WrittenRotation(
        robot_poses,
        quaternion_order,
        (first, second, third),
        data["order"],
        bool(data.get("degrees", False)),
    )


def written_between(
    start: WrittenRotation | None,
    end: WrittenRotation | None,
    share: float,
    base_T_gripper: FloatArray,
) -> WrittenRotation | None:
    """Return how a pose on the way between two that were written in the same form is written.

    Euler angles on the way go along where they give the pose, as they do while the robot rests.

    Args:
        start: How the pose at share 0 was written.
        end: How the pose at share 1 was written.
        share: From 0 to 1.
        base_T_gripper: (4, 4) the pose between them.
    """
    if start is None or end is None or start.euler is None or end.euler is None:
        return start
    turn = 360.0 if start.degrees else math.tau
    first, second, third = (
        angle + share * math.remainder(other - angle, turn)
        for angle, other in zip(start.euler, end.euler, strict=True)
    )
    on_the_way = replace(start, euler=(first, second, third))
    if _apart(on_the_way, base_T_gripper) <= _SAME:
        return on_the_way
    plain = replace(start, euler=None, order="", degrees=False)
    return None if plain == WrittenRotation() else plain


def _apart(written: WrittenRotation, base_T_gripper: FloatArray) -> float:
    """Return the angle between a pose and what its Euler angles give, radians."""
    angles = euler_angles(written.euler or (), written.degrees)
    R = rotations.matrix_from_euler(angles, written.order)
    if written.robot_poses is RobotPoses.BASE_IN_GRIPPER:
        R = R.T
    return float(rotations.angle(R.T @ base_T_gripper[:3, :3]))


def _require_same(written: WrittenRotation, base_T_gripper: FloatArray, place: Place) -> None:
    if written.euler is None:
        return
    apart = _apart(written, base_T_gripper)
    if apart > _SAME:
        raise InputError(
            "expected the Euler angles that base_T_gripper was written with, found angles of a "
            f"rotation {np.degrees(apart):.3g} deg away from it",
            where=str(place.key("euler")),
            hint="take 'written' out where the pose has been changed, and leave flags such as "
            "--quaternion-order to the command that reads the first document",
        )


def data_from_written(written: WrittenRotation | None) -> dict[str, Any] | None:
    """Return the mapping `written` of a station, or None for the default form."""
    if written is None:
        return None
    data: dict[str, Any] = {"robot_poses": str(written.robot_poses)}
    if written.quaternion_order is not QuaternionOrder.XYZW:
        data["quaternion_order"] = str(written.quaternion_order)
    if written.euler is not None:
        data |= {"euler": list(written.euler), "order": written.order, "degrees": written.degrees}
    return data
