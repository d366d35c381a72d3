"""What every registered export owes: an independent reader finds the same pose between its frames.

Each reader does with the text what its consumer does; none uses what the writers are made of.
"""

from __future__ import annotations

import ast
import csv
import io
import re
import shlex
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from handeye_cli.conventions import Setup
from handeye_cli.documents import exports
from handeye_cli.records import Camera
from handeye_cli.records.named_transform import NamedTransform

PARENT, CHILD = "ur10e/tool0", "camera_color_optical_frame"
CAMERA = Camera(640, 480, 550.5, 551.25, 320.0, 240.0, (0.1, -0.2, 1e-5, 3e-4))
TOLERANCE = 1e-12
"""Of an entry of the matrix: all formats write doubles, and the lengths are at most a metre."""


def matrix_of(rotation, translation):
    T = np.eye(4)
    T[:3, :3] = rotation.as_matrix()
    T[:3, 3] = translation
    return T


def launch_arguments(line):
    """Arguments of ROS 2's publisher in its form with flags."""
    values = dict(zip(line[::2], line[1::2], strict=True))
    t = [float(values.pop(f"--{axis}")) for axis in "xyz"]
    q = [float(values.pop(f"--q{axis}")) for axis in "xyzw"]
    parent, child = values.pop("--frame-id"), values.pop("--child-frame-id")
    assert not values
    return matrix_of(Rotation.from_quat(q), t), parent, child


def read_static_transform_publisher(text, _):
    words = shlex.split(text)
    assert words[:4] == ["ros2", "run", "tf2_ros", "static_transform_publisher"]
    return launch_arguments(words[4:])


def read_ros2_launch(text, _):
    tree = ast.parse(text)
    assert "generate_launch_description" in {
        node.name for node in tree.body if isinstance(node, ast.FunctionDef)
    }
    [node] = [
        each
        for each in ast.walk(tree)
        if isinstance(each, ast.Call) and getattr(each.func, "id", "") == "Node"
    ]
    keywords = {each.arg: ast.literal_eval(each.value) for each in node.keywords}
    assert keywords["package"] == "tf2_ros"
    assert keywords["executable"] == "static_transform_publisher"
    return launch_arguments(keywords["arguments"])


def read_urdf(text, _):
    joint = ElementTree.fromstring(text)
    assert (joint.tag, joint.get("type")) == ("joint", "fixed")
    assert joint.get("name")
    origin = joint.find("origin")
    # lower case is fixed axes: about x first, then y, then z, as REP 103 wants it
    R = Rotation.from_euler("xyz", [float(each) for each in origin.get("rpy").split()])
    T = matrix_of(R, [float(each) for each in origin.get("xyz").split()])
    return T, joint.find("parent").get("link"), joint.find("child").get("link")


def read_moveit(text, _):
    [node] = ElementTree.fromstring(text)
    assert (node.get("pkg"), node.get("type")) == ("tf2_ros", "static_transform_publisher")
    *numbers, parent, child = node.get("args").split()
    values = [float(each) for each in numbers]
    assert len(values) == 7  # with one less they would be yaw, pitch and roll
    return matrix_of(Rotation.from_quat(values[3:]), values[:3]), parent, child


def read_easy_handeye(text, setup):
    data = yaml.safe_load(text)
    parameters, numbers = data["parameters"], data["transformation"]
    # what the constructor takes in all of its releases; `freehand_robot_movement` is not in all
    assert parameters.keys() == {
        "namespace", "eye_on_hand", "robot_base_frame", "robot_effector_frame",
        "tracking_base_frame", "tracking_marker_frame", "move_group_namespace", "move_group",
    }  # fmt: skip
    assert None not in parameters.values()  # the parameter server takes none
    assert parameters["namespace"].endswith("/")
    assert parameters["eye_on_hand"] is (setup is Setup.EYE_IN_HAND)
    key = "robot_effector_frame" if parameters["eye_on_hand"] else "robot_base_frame"
    T = matrix_of(
        Rotation.from_quat([numbers[each] for each in ("qx", "qy", "qz", "qw")]),
        [numbers[each] for each in "xyz"],
    )
    return T, parameters[key], parameters["tracking_base_frame"]


def read_easy_handeye2(text, setup):
    data = yaml.safe_load(text)
    assert data.keys() == {"parameters", "transform"}
    parameters, pose = data["parameters"], data["transform"]
    texts = {
        "name", "calibration_type", "robot_base_frame", "robot_effector_frame",
        "tracking_base_frame", "tracking_marker_frame", "move_group_namespace", "move_group",
    }  # fmt: skip
    assert parameters.keys() == texts | {"freehand_robot_movement"}
    assert all(isinstance(parameters[each], str) for each in texts)
    in_hand = setup is Setup.EYE_IN_HAND
    assert parameters["calibration_type"] == ("eye_in_hand" if in_hand else "eye_on_base")
    parent = parameters["robot_effector_frame" if in_hand else "robot_base_frame"]
    q, t = ([pose[key][axis] for axis in axes] for key, axes in
            (("rotation", "xyzw"), ("translation", "xyz")))  # fmt: skip
    assert all(isinstance(each, float) for each in (*q, *t))  # a message's field takes no int
    return matrix_of(Rotation.from_quat(q), t), parent, parameters["tracking_base_frame"]


def read_opencv(text, setup):
    storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    T = storage.getNode("parent_T_child").mat()
    np.testing.assert_array_equal(storage.getNode("R").mat(), T[:3, :3])
    np.testing.assert_array_equal(storage.getNode("t").mat(), T[:3, 3:])
    assert storage.getNode("setup").string() == setup
    return T, storage.getNode("parent").string(), storage.getNode("child").string()


def read_csv(text, _):
    rows = list(csv.reader(io.StringIO(text)))
    assert [len(row) for row in rows] == [4, 4, 4, 4]
    return np.loadtxt(io.StringIO(text), delimiter=","), None, None


def read_kalibr(text, _):
    camera = yaml.safe_load(text)["cam0"]
    return np.linalg.inv(np.array(camera["T_cam_imu"])), None, None


def read_zivid(text, _):
    data = yaml.safe_load(text)
    assert data["__version__"] == {"serializer": 1, "data": 1}
    T = np.array(data["FloatMatrix"]["Data"])
    T[:3, 3] /= 1000.0
    return T, None, None


READERS = {
    "static-transform-publisher": read_static_transform_publisher,
    "ros2-launch": read_ros2_launch,
    "urdf": read_urdf,
    "easy-handeye": read_easy_handeye,
    "easy-handeye2": read_easy_handeye2,
    "moveit": read_moveit,
    "opencv": read_opencv,
    "csv": read_csv,
    "kalibr": read_kalibr,
    "zivid": read_zivid,
}


def rotations():
    """Rotations at which a quaternion or three angles are hard to read off a matrix, and others."""
    yield from (Rotation.from_rotvec(angle * axis) for axis in np.eye(3) for angle in (0, 1e-9))
    for axis in (*np.eye(3), -np.ones(3) / np.sqrt(3)):
        yield from (Rotation.from_rotvec(angle * axis) for angle in (np.pi, np.pi - 1e-9))
    for off in (0.0, 1e-13, 1e-9, 1e-5):
        for sign in (1, -1):
            # roll first, so the two that turn about one axis at the lock are both not zero
            yield Rotation.from_euler("xyz", [0.7, sign * (np.pi / 2 - off), -1.9])
    yield Rotation.from_quat([-0.5, 0.5, -0.5, 0.5])  # from a link to its optical frame
    yield from Rotation.from_quat(np.random.default_rng(8).normal(size=(20, 4)))


ROTATIONS = [each.as_matrix() for each in rotations()]


def transform(R, t, setup):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, t
    return NamedTransform(PARENT, CHILD, T, setup, camera=CAMERA)


def test_every_format_has_a_reader():
    assert READERS.keys() == exports.FORMATS.keys()


@pytest.mark.parametrize("name", exports.FORMATS)
@pytest.mark.parametrize("setup", Setup)
def test_the_pose_is_read_back(name, setup):
    rng = np.random.default_rng(3)
    for R in ROTATIONS:
        given = transform(R, rng.uniform(-1.0, 1.0, 3), setup)
        T, parent, child = READERS[name](exports.text(given, name), setup)
        np.testing.assert_allclose(T, given.matrix, rtol=0.0, atol=TOLERANCE)
        assert (parent, child) in ((PARENT, CHILD), (None, None))
        assert exports.FORMATS[name].needs_names <= (parent is not None)


@pytest.mark.parametrize("name", exports.FORMATS)
@pytest.mark.parametrize("t", [(0.0, -0.0, 0.0), (1e-7, -3e-16, 1e-05), (1234.5, -1 / 3, 2e6)])
def test_awkward_lengths_are_read_back(name, t):
    given = transform(np.eye(3), t, Setup.EYE_IN_HAND)
    written = exports.text(given, name)
    T, _, _ = READERS[name](written, Setup.EYE_IN_HAND)
    np.testing.assert_allclose(T[:3, 3], t, rtol=1e-15, atol=0.0)
    assert not re.search(r"-0\.0(?![0-9])", written)


@pytest.mark.parametrize("name", exports.FORMATS)
def test_a_text_ends_with_its_line_and_is_the_same_again(name):
    given = transform(ROTATIONS[-1], (0.1, 0.2, 0.3), Setup.EYE_TO_HAND)
    written = exports.text(given, name)
    assert written.endswith("\n")
    assert not written.endswith("\n\n")
    assert written == exports.text(given, name)
    assert written.isascii()
