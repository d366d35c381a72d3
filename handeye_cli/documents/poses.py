"""Poses of documents, in every form and convention the contract allows.

The shape of what is read here (lengths of lists, which keys go together) has been checked by the
schema; here are the checks that need arithmetic.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from handeye_cli.conventions import PoseUnits, QuaternionOrder, RobotPoses
from handeye_cli.documents.covariances import covariance_from_data, data_from_covariance
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError
from handeye_cli.geometry import rotations, se3
from handeye_cli.records import FloatArray, UncertainPose

_NEAR_UNIT = 1e-2
"""Departure of a quaternion's norm from 1 that rounded digits explain."""
_NEAR_ROTATION = 1e-3
"""Frobenius distance of a matrix from SO(3) that rounded digits explain."""
_NEAR_LAST_ROW = 1e-6
_FULL_TURN = 2.0 * math.pi * (1.0 + 1e-6)


@dataclass(frozen=True)
class PoseConventions:
    """How the poses of a document are written.

    Attributes:
        units: Unit of the translations and of the translations in covariances.
        quaternion_order: Order of the quaternions' numbers.
        robot_poses: Direction of the entries `base_T_gripper`.
    """

    units: PoseUnits = PoseUnits.M
    quaternion_order: QuaternionOrder = QuaternionOrder.XYZW
    robot_poses: RobotPoses = RobotPoses.GRIPPER_IN_BASE


def pose_from_data(
    data: dict[str, Any], conventions: PoseConventions, place: Place
) -> UncertainPose:
    """Return a pose and its covariance, in metres and radians.

    Args:
        data: A pose as the schema allows it.
        conventions: How the document writes poses.
        place: Where the pose stands.

    Raises:
        InputError: The numbers are no rotation, or no covariance.
    """
    metres = conventions.units.metres
    if "matrix" in data:
        matrix = _transform(data["matrix"], place.key("matrix"))
        matrix[:3, 3] *= metres
    else:
        translation = metres * np.array(data["translation"], dtype=float)
        matrix = se3.from_parts(_rotation(data, conventions, place), translation)
    if "covariance" not in data:
        return UncertainPose(matrix)
    covariance = covariance_from_data(data["covariance"], 6, place.key("covariance"))
    scale = np.array([metres] * 3 + [1.0] * 3)
    return UncertainPose(matrix, covariance * np.outer(scale, scale))


def robot_pose_from_data(
    data: dict[str, Any], conventions: PoseConventions, place: Place
) -> FloatArray:
    """Return the (4, 4) `base_T_gripper` of a robot's pose, whichever way round it was written.

    Raises:
        InputError: The numbers are no rotation, or a covariance is given.
    """
    if "covariance" in data:
        raise InputError(
            "expected a robot pose without a covariance of its own, found one",
            where=str(place.key("covariance")),
            hint="give the robot's noise once: noise: {robot_rotation_mrad, robot_translation_mm}",
        )
    return uncertain_robot_pose_from_data(data, conventions, place).matrix


def uncertain_robot_pose_from_data(
    data: dict[str, Any], conventions: PoseConventions, place: Place
) -> UncertainPose:
    """Return `base_T_gripper` and what is known of its error beside the robot's noise.

    Raises:
        InputError: The numbers are no rotation, or no covariance.
    """
    pose = pose_from_data(data, conventions, place)
    if conventions.robot_poses is not RobotPoses.BASE_IN_GRIPPER:
        return pose
    turned = se3.inverse_jacobian(pose.matrix)
    covariance = None if pose.covariance is None else turned @ pose.covariance @ turned.T
    return UncertainPose(se3.inverse(pose.matrix), covariance)


def data_from_pose(pose: UncertainPose) -> dict[str, Any]:
    """Return a pose as translation in metres, quaternion x y z w, and covariance when known."""
    data: dict[str, Any] = data_from_matrix(pose.matrix)
    covariance = data_from_covariance(pose.covariance)
    return data if covariance is None else data | {"covariance": covariance}


def data_from_matrix(matrix: FloatArray) -> dict[str, Any]:
    """Return a (4, 4) pose as translation in metres and quaternion x y z w."""
    quaternion = rotations.quaternion_from_matrix(matrix[:3, :3])
    # adding zero turns -0.0 into 0.0
    return {
        "translation": (matrix[:3, 3] + 0.0).tolist(),
        "quaternion": (quaternion + 0.0).tolist(),
    }


def _rotation(data: dict[str, Any], conventions: PoseConventions, place: Place) -> FloatArray:
    if "quaternion" in data:
        order = conventions.quaternion_order
        return _from_quaternion(data["quaternion"], order, place.key("quaternion"))
    if "rotvec" in data:
        rotvec = np.array(data["rotvec"], dtype=float)
        _require_turns_within_one(rotvec, place.key("rotvec"), "a rotation vector is in radians")
        return rotations.exp(rotvec)
    angles = euler_angles(data["euler"], data.get("degrees", False))
    _require_turns_within_one(angles, place.key("euler"), "say degrees: true if they are degrees")
    return rotations.matrix_from_euler(angles, data["order"])


def euler_angles(numbers: Sequence[float], degrees: bool) -> FloatArray:
    """Return the (3,) Euler angles of three numbers, in radians whether or not these are so."""
    angles = np.array(numbers, dtype=float)
    return np.deg2rad(angles) if degrees else angles


def _require_turns_within_one(angles: FloatArray, place: Place, hint: str) -> None:
    largest = float(angles[np.argmax(np.abs(angles))])
    if abs(largest) > _FULL_TURN:
        message = f"expected angles of at most a full turn, found {largest:g} rad"
        raise InputError(message, where=str(place), hint=hint)


def _from_quaternion(numbers: list[Any], order: QuaternionOrder, place: Place) -> FloatArray:
    quaternion = np.array(numbers, dtype=float)
    norm = float(np.linalg.norm(quaternion))
    if abs(norm - 1.0) > _NEAR_UNIT:
        raise InputError(
            f"expected a quaternion of norm 1 (within {_NEAR_UNIT}), found the norm {norm:.6g}",
            where=str(place),
        )
    if order is QuaternionOrder.WXYZ:
        quaternion = np.roll(quaternion, -1)
    return rotations.matrix_from_quaternion(quaternion)


def _transform(rows: list[list[Any]], place: Place) -> FloatArray:
    matrix = np.array(rows, dtype=float)
    if np.max(np.abs(matrix[3] - [0.0, 0.0, 0.0, 1.0])) > _NEAR_LAST_ROW:
        found = f"found {matrix[3].tolist()}"
        raise InputError(f"expected the last row [0, 0, 0, 1], {found}", where=str(place))
    R = _nearest_rotation(matrix[:3, :3], place)
    return se3.from_parts(R, matrix[:3, 3])


def _nearest_rotation(M: FloatArray, place: Place) -> FloatArray:
    determinant = float(np.linalg.det(M))
    if determinant < 0.0:
        raise InputError(
            f"expected a rotation, found a mirror image (its determinant is {determinant:.6g})",
            where=str(place),
            hint="a left-handed frame: one axis points the wrong way, or two are swapped",
        )
    R = rotations.project_to_so3(M)
    distance = float(np.linalg.norm(M - R))
    if distance > _NEAR_ROTATION:
        raise InputError(
            f"expected a rotation matrix (within {_NEAR_ROTATION}), found one that is "
            f"{distance:.3g} away from the nearest rotation",
            where=str(place),
        )
    return R
