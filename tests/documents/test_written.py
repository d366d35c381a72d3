"""How robot poses were written goes along through all documents, to the last digit."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handeye_cli import documents
from handeye_cli.conventions import QuaternionOrder, RobotPoses
from handeye_cli.documents import ReadOptions
from handeye_cli.errors import InputError
from handeye_cli.records.line import WrittenRotation

ANGLES = [179.9, 1 / 3, -12.5]
EULER = {"translation": [0.1, 0.2, 0.3], "euler": ANGLES, "order": "ZYX", "degrees": True}
PLAIN = {"translation": [0.1, 0.2, 0.3], "quaternion": [0.1, 0.7, 0.1, 0.7]}
SEEN = {"translation": [0, 0, 1], "quaternion": [1, 0, 0, 0]}
INVERSE = RobotPoses.BASE_IN_GRIPPER
FLAG = ReadOptions(robot_poses=INVERSE)


def stations_data(pose, **keys):
    entry = {"name": "a", "base_T_gripper": pose, "camera_T_target": SEEN} | keys
    return {"schema": "handeye/stations/1", "setup": "eye-in-hand", "stations": [entry]}


KINDS = {
    "recording": ({"image": "a.png"}, {}),
    "features": ({"found": False, "reason": "dark"}, {"target": {"type": "disc-grid"}}),
    "stations": ({"camera_T_target": SEEN}, {}),
}


def data_of(kind, pose):
    keys, more = KINDS[kind]
    head = {"schema": f"handeye/{kind}/1", "setup": "eye-in-hand"}
    return head | more | {"stations": [{"name": "a", "base_T_gripper": pose} | keys]}


def read(data, options=None):
    content = io.BytesIO((data if isinstance(data, str) else json.dumps(data)).encode())
    return documents.read("-", options or ReadOptions(), content)


def written(record):
    return record.stations[0].written


@pytest.mark.parametrize("form", ["yaml", "json"])
@pytest.mark.parametrize("kind", KINDS)
def test_euler_angles_come_back_after_the_pose_was_written_as_a_quaternion(kind, form):
    first = read(data_of(kind, EULER))
    assert written(first) == WrittenRotation(euler=tuple(ANGLES), order="ZYX", degrees=True)
    text = documents.dump(first, form)
    again = read(text)
    assert "quaternion" in text
    assert written(again) == written(first)
    assert written(documents.as_written(first)) == written(first)
    assert documents.dump(again, form) == text


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("pose", [EULER, PLAIN])
def test_the_declared_direction_goes_along(kind, pose):
    first = read(data_of(kind, pose), FLAG)
    again = read(documents.dump(first, "json"))
    assert written(again) == written(first)
    assert written(again).robot_poses is INVERSE
    if pose is EULER:
        R = Rotation.from_euler("ZYX", ANGLES, degrees=True).inv().as_matrix()
        np.testing.assert_allclose(again.stations[0].base_T_gripper[:3, :3], R, atol=1e-14)


def test_the_declared_order_of_quaternions_goes_along():
    wxyz = QuaternionOrder.WXYZ
    first = read(stations_data(PLAIN), ReadOptions(quaternion_order=wxyz))
    assert written(read(documents.dump(first, "yaml"))) == WrittenRotation(quaternion_order=wxyz)


def test_poses_in_the_default_form_need_no_words():
    first = read(stations_data(PLAIN))
    assert written(first) is None
    assert "written" not in documents.dump(first, "yaml")


def test_a_later_flag_turns_the_direction_round():
    first = read(stations_data(EULER))
    second, third = (first := read(documents.dump(first, "json"), FLAG) for _ in range(2))
    assert written(second).robot_poses is INVERSE
    assert written(third).robot_poses is RobotPoses.GRIPPER_IN_BASE


FAULTS = {
    "other angles": (
        {"euler": [179.9, 1 / 3, -11.5], "order": "ZYX"},
        "found angles of a rotation",
    ),
    "no order": ({"euler": ANGLES}, "'order' beside 'euler'"),
    "no angles": ({"degrees": True}, "'euler' beside 'degrees'"),
    "wrong direction": ({"robot_poses": "gripper-to-base"}, "did you mean gripper-in-base"),
    "unknown key": ({"eulers": ANGLES}, "did you mean 'euler'"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_wrong_note_is_refused(fault):
    note, message = FAULTS[fault]
    with pytest.raises(InputError) as caught:
        read(stations_data(PLAIN, written=note))
    assert message in str(caught.value)
    assert "stations[0]" in caught.value.where
    assert "written" in caught.value.where


def test_angles_that_do_not_fit_say_what_to_do():
    note = {"euler": ANGLES, "order": "ZYX", "degrees": True}
    pose = {"translation": [0, 0, 0], "quaternion": [0, 0, 0, 1]}
    apart = np.degrees(Rotation.from_euler("ZYX", ANGLES, degrees=True).magnitude())
    with pytest.raises(InputError, match=f"found angles of a rotation {apart:.3g} deg") as caught:
        read(stations_data(pose, written=note))
    assert "take 'written' out" in caught.value.hint
