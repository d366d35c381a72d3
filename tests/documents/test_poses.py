"""Pose forms and conventions against SciPy, covariances against sampling, faults as a table."""

from __future__ import annotations

import numpy as np
import pytest
from documents import samples
from scipy.spatial.transform import Rotation

from handeye_cli.conventions import PoseUnits, QuaternionOrder, RobotPoses
from handeye_cli.documents.place import Place
from handeye_cli.documents.poses import (
    PoseConventions,
    data_from_pose,
    pose_from_data,
    robot_pose_from_data,
)
from handeye_cli.errors import InputError
from handeye_cli.geometry import se3

PLACE = Place("f.yaml", "pose")
PLAIN = PoseConventions()
T = [0.1, -0.2, 0.3]


def rotation(rng):
    return Rotation.random(random_state=int(rng.integers(1 << 30)))


def forms(turn):
    """One rotation in every form the contract allows."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn.as_matrix(), T
    yield {"translation": T, "quaternion": turn.as_quat().tolist()}
    yield {"translation": T, "quaternion": (-turn.as_quat()).tolist()}
    yield {"translation": T, "rotvec": turn.as_rotvec().tolist()}
    yield {"matrix": matrix.tolist()}
    for order in ("xyz", "ZYX", "zxz", "YXY"):
        angles = turn.as_euler(order)
        yield {"translation": T, "euler": angles.tolist(), "order": order}
        degrees = np.rad2deg(angles).tolist()
        yield {"translation": T, "euler": degrees, "order": order, "degrees": True}


@pytest.mark.filterwarnings("ignore:Gimbal lock")
def test_every_form_gives_the_same_pose():
    rng = np.random.default_rng(1)
    for turn in [rotation(rng) for _ in range(10)] + [Rotation.identity()]:
        for data in forms(turn):
            pose = pose_from_data(data, PLAIN, PLACE)
            np.testing.assert_allclose(pose.matrix[:3, :3], turn.as_matrix(), atol=5e-15)
            np.testing.assert_array_equal(pose.matrix[:, 3], [*T, 1.0])
            assert pose.covariance is None


def test_millimetres_scale_translations_and_covariances():
    rng = np.random.default_rng(2)
    expected = samples.uncertain(rng)
    data = data_from_pose(expected)
    millimetres = np.array([1e3] * 3 + [1.0] * 3)
    data["translation"] = (1e3 * expected.matrix[:3, 3]).tolist()
    data["covariance"] = (expected.covariance * np.outer(millimetres, millimetres)).tolist()
    conventions = PoseConventions(units=PoseUnits.MM)
    found = pose_from_data(data, conventions, PLACE)
    np.testing.assert_allclose(found.matrix, expected.matrix, atol=1e-14)
    np.testing.assert_allclose(found.covariance, expected.covariance, rtol=1e-14, atol=1e-24)
    matrix = expected.matrix.copy()
    matrix[:3, 3] *= 1e3
    found = pose_from_data({"matrix": matrix.tolist()}, conventions, PLACE)
    np.testing.assert_allclose(found.matrix, expected.matrix, atol=1e-14)


def test_quaternion_order_wxyz():
    turn = rotation(np.random.default_rng(3))
    x, y, z, w = turn.as_quat().tolist()
    conventions = PoseConventions(quaternion_order=QuaternionOrder.WXYZ)
    found = pose_from_data({"translation": T, "quaternion": [w, x, y, z]}, conventions, PLACE)
    np.testing.assert_allclose(found.matrix[:3, :3], turn.as_matrix(), atol=5e-15)


def test_robot_poses_base_in_gripper_are_inverted():
    matrix = samples.pose(np.random.default_rng(4))
    conventions = PoseConventions(robot_poses=RobotPoses.BASE_IN_GRIPPER)
    data = {"matrix": np.linalg.inv(matrix).tolist()}
    np.testing.assert_allclose(robot_pose_from_data(data, conventions, PLACE), matrix, atol=1e-14)
    # other poses of the document are not the robot's
    np.testing.assert_allclose(
        pose_from_data(data, conventions, PLACE).matrix, np.linalg.inv(matrix), atol=1e-14
    )


def test_rounded_digits_are_taken_for_a_rotation():
    turn = rotation(np.random.default_rng(5))
    matrix = np.eye(4)
    matrix[:3, :3] = np.round(turn.as_matrix(), 4)
    quaternion = np.round(turn.as_quat(), 3).tolist()
    for data, tolerance in (
        ({"matrix": matrix.tolist()}, 3e-4),
        ({"translation": T, "quaternion": quaternion}, 3e-3),
    ):
        R = pose_from_data(data, PLAIN, PLACE).matrix[:3, :3]
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-15)
        np.testing.assert_allclose(R, turn.as_matrix(), atol=tolerance)


def test_rounded_and_singular_covariances_are_accepted_and_made_symmetric():
    rng = np.random.default_rng(6)
    thin = np.outer(*[1e-3 * rng.normal(size=6)] * 2)
    rounded = np.array([[float(f"{number:.7g}") for number in row] for row in thin])
    rounded[0, 1] *= 1.0 + 5e-7
    pose = {"translation": T, "rotvec": [0.0, 0.0, 0.0]}
    for rows in (rounded, np.zeros((6, 6)), np.diag([1e-6, 0, 0, 0, 0, 1e-6])):
        found = pose_from_data(pose | {"covariance": rows.tolist()}, PLAIN, PLACE).covariance
        np.testing.assert_array_equal(found, found.T)
        np.testing.assert_allclose(found, rows, rtol=1e-6)


def transform(**changes):
    matrix = np.eye(4)
    for key, value in changes.items():
        matrix[int(key[1]), int(key[2])] = value
    return {"matrix": matrix.tolist()}


def spread(**changes):
    covariance = 1e-6 * np.eye(6)
    for key, value in changes.items():
        covariance[int(key[1]), int(key[2])] = value
    return {"translation": T, "rotvec": [0, 0, 0], "covariance": covariance.tolist()}


FAULTS = [
    ({"translation": T, "quaternion": [0, 0, 0, 1.02]}, "found the norm 1.02", "pose.quaternion"),
    ({"translation": T, "quaternion": [0, 0, 0, 0]}, "found the norm 0", "pose.quaternion"),
    (transform(m22=-1.0), "mirror image .its determinant is -1", "pose.matrix"),
    (transform(m00=1.002), "0.002 away from the nearest rotation", "pose.matrix"),
    (transform(m00=0.0), "1 away from the nearest rotation", "pose.matrix"),
    (transform(m33=2.0), r"found \[0.0, 0.0, 0.0, 2.0\]", "pose.matrix"),
    ({"translation": T, "rotvec": [0, 90, 0]}, "found 90 rad", "pose.rotvec"),
    ({"translation": T, "euler": [0, -90, 0], "order": "xyz"}, "found -90 rad", "pose.euler"),
    (spread(c01=1e-9), r"found 1e-09 at \[0\]\[1\] and 0 at \[1\]\[0\]", "pose.covariance"),
    (spread(c22=-1e-7), "found the eigenvalue -1e-07", "pose.covariance"),
    (spread(c01=2e-6, c10=2e-6), "found the eigenvalue -1e-06", "pose.covariance"),
]


@pytest.mark.parametrize(("data", "message", "path"), FAULTS)
def test_numbers_that_are_no_pose_are_refused(data, message, path):
    with pytest.raises(InputError, match=message) as caught:
        pose_from_data(data, PLAIN, PLACE)
    assert caught.value.where == f"f.yaml: {path}"


def test_a_robot_pose_has_no_covariance_of_its_own():
    with pytest.raises(InputError, match="without a covariance") as caught:
        robot_pose_from_data(spread(), PLAIN, PLACE)
    assert "robot_rotation_mrad" in caught.value.hint


def test_writing_leaves_no_negative_zeros():
    turned = se3.from_parts(np.diag([1.0, -1.0, -1.0]), np.array([-0.0, 0.0, 1.0]))
    data = data_from_pose(samples.UncertainPose(turned, -np.zeros((6, 6))))
    assert "-0.0" not in repr(data)
