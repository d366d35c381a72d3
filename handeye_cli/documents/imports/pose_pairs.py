"""Poses of other tools as stations of the line: one of the robot, and one of target or picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from handeye_cli.documents.place import Place
from handeye_cli.documents.poses import PoseConventions, pose_from_data, robot_pose_from_data
from handeye_cli.documents.written import written_from_data
from handeye_cli.images import ImageFile
from handeye_cli.records import FloatArray, RecordedStation, Station
from handeye_cli.records.line import WrittenRotation


@dataclass(frozen=True)
class PlacedPose:
    """A pose as our own documents write it, and where it stands in the file.

    Attributes:
        data: `translation` with `quaternion`, `rotvec` or `euler`; or `matrix`.
        place: Where in the file it comes from.
    """

    data: dict[str, Any]
    place: Place


def from_rows(numbers: Sequence[float], place: Place) -> PlacedPose:
    """Return the pose of the 16 numbers of a 4x4 matrix, row by row."""
    rows = [list(numbers[start : start + 4]) for start in range(0, 16, 4)]
    return PlacedPose({"matrix": rows}, place)


def station(
    name: str,
    robot: PlacedPose,
    target: PlacedPose,
    conventions: PoseConventions,
) -> Station:
    """Return a station of poses.

    Args:
        name: Of the station.
        robot: `base_T_gripper`, or its inverse where the conventions say so.
        target: `camera_T_target`.
        conventions: How the file writes poses.

    Raises:
        InputError: One of them is no pose.
    """
    pose, written = robot_pose(robot, conventions)
    seen = pose_from_data(target.data, conventions, target.place)
    return Station(name, pose, camera_T_target=seen, written=written)


def unseen(name: str, robot: PlacedPose, reason: str, conventions: PoseConventions) -> Station:
    """Return a station whose target was not found.

    Raises:
        InputError: The robot's is no pose.
    """
    pose, written = robot_pose(robot, conventions)
    return Station(name, pose, reason=reason, written=written)


def recorded(
    name: str, robot: PlacedPose, image: ImageFile, conventions: PoseConventions
) -> RecordedStation:
    """Return a station with a picture.

    Raises:
        InputError: The robot's is no pose.
    """
    pose, written = robot_pose(robot, conventions)
    return RecordedStation(name, pose, image, written)


def robot_pose(
    robot: PlacedPose, conventions: PoseConventions
) -> tuple[FloatArray, WrittenRotation | None]:
    """Return the (4, 4) `base_T_gripper` of a robot's pose, and how it was written.

    Raises:
        InputError: It is no pose.
    """
    pose = robot_pose_from_data(robot.data, conventions, robot.place)
    entry = {"base_T_gripper": robot.data}
    return pose, written_from_data(entry, pose, conventions, robot.place)
