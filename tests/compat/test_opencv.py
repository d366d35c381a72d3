"""The drop-in against OpenCV 4 itself, where it is installed, and against its stored answers."""

from __future__ import annotations

import inspect
import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from scenes import disturbed, general_scene, joint_covariance, scene

from handeye_cli.compat import opencv
from handeye_cli.errors import HandeyeError
from handeye_cli.geometry import rotations, se3
from handeye_cli.records import Noise

NOISE = Noise(1.5e-3, 1.3e-4, 1.5e-3, 0.8e-4)
HAND_EYE = ["TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS"]
ROBOT_WORLD = ["SHAH", "LI"]
PLANAR_FAILURES = {"ANDREFF", "LI"}
GOLDEN = json.loads(Path(__file__).with_name("opencv_golden.json").read_text(encoding="utf-8"))
SIGNATURES = {
    "calibrateHandEye": "R_gripper2base, t_gripper2base, R_target2cam, t_target2cam"
    "[, R_cam2gripper[, t_cam2gripper[, method]]]",
    "calibrateRobotWorldHandEye": "R_world2cam, t_world2cam, R_base2gripper, t_base2gripper"
    "[, R_base2world[, t_base2world[, R_gripper2cam[, t_gripper2cam[, method]]]]]",
}
with_opencv_4 = pytest.mark.skipif(
    not hasattr(cv2, "calibrateHandEye"),
    reason=f"OpenCV {cv2.__version__} has no calibrateHandEye: the stored answers are tested",
)


def planar(rng, count):
    return scene(rng, count, angle=rng.uniform(0.1, 2.8))


def general(rng, count):
    """Answers away from 180 degrees, where OpenCV's Tsai method is singular."""
    while rotations.angle((perfect := general_scene(rng, count)).X[:3, :3]) > 3.0:
        pass
    return perfect


def noisy(layout, seed, count, noise=NOISE):
    rng = np.random.default_rng(seed)
    perfect = layout(rng, count)
    joint = joint_covariance(count, noise)
    A = disturbed(rng, perfect.A, joint[:, :6, :6])
    return perfect, A, disturbed(rng, perfect.B, joint[:, 6:, 6:])


def parts(poses):
    return poses[:, :3, :3], poses[:, :3, 3]


def hand_eye(A, B, name, module=opencv):
    method = getattr(module, f"CALIB_HAND_EYE_{name}")
    return module.calibrateHandEye(*parts(A), *parts(B), method=method)


def robot_world(A, B, name, module=opencv):
    method = getattr(module, f"CALIB_ROBOT_WORLD_HAND_EYE_{name}")
    inverse = se3.inverse(A)
    return module.calibrateRobotWorldHandEye(*parts(B), *parts(inverse), method=method)


def assert_equal(found, expected):
    assert isinstance(found, tuple)
    for ours, theirs in zip(found, expected, strict=True):
        assert ours.shape == np.shape(theirs)
        assert ours.dtype == np.float64
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-6)


CALLS = [
    pytest.param(layout, name, id=f"{layout.__name__}-{name}")
    for layout in (planar, general)
    for name in HAND_EYE + ROBOT_WORLD
    if layout is general or name not in PLANAR_FAILURES
]


@with_opencv_4
@pytest.mark.parametrize("count", range(3, 13))
@pytest.mark.parametrize(("layout", "name"), CALLS)
def test_noisy_stations_give_what_opencv_gives(layout, name, count):
    call = hand_eye if name in HAND_EYE else robot_world
    for seed, unit in enumerate((1.0, 1.0, 1000.0)):
        _, A, B = noisy(layout, 10 * count + seed, count)
        A[:, :3, 3] *= unit
        B[:, :3, 3] *= unit
        found, expected = call(A, B, name), call(A, B, name, cv2)
        assert_equal(found[::2], expected[::2])
        assert_equal(*(tuple(t / unit for t in answer[1::2]) for answer in (found, expected)))


@pytest.mark.parametrize("case", GOLDEN["cases"], ids=lambda case: case["layout"])
def test_stored_answers_of_opencv(case):
    robot, camera = np.array(case["gripper2base"]), np.array(case["target2cam"])
    for name, expected in case["hand_eye"].items():
        method = getattr(opencv, f"CALIB_HAND_EYE_{name}")
        assert_equal(opencv.calibrateHandEye(*robot, *camera, method=method), expected)
    A = se3.from_parts(rotations.exp(robot[0]), robot[1])
    B = se3.from_parts(rotations.exp(camera[0]), camera[1])
    for name, expected in case["robot_world"].items():
        assert_equal(robot_world(A, B, name), expected)


def test_the_stored_answers_have_every_method():
    general = [case for case in GOLDEN["cases"] if case["layout"] == "general_scene"]
    assert len(general) == 3
    for case in general:
        assert list(case["hand_eye"]) == HAND_EYE
        assert list(case["robot_world"]) == ROBOT_WORLD


@pytest.mark.parametrize("unit", [1.0, 1000.0])
@pytest.mark.parametrize("name", ["ANDREFF", "LI"])
def test_axes_in_one_plane_where_opencv_fails(name, unit):
    """All cameras look at the target's origin from one distance; lengths in metres or in mm."""
    truth, A, B = noisy(planar, 5, 12)
    A[:, :3, 3] *= unit
    B[:, :3, 3] *= unit
    if name == "LI":
        R, t = robot_world(A, B, name)[2:]
        found = se3.inverse(se3.from_parts(R, t[:, 0] / unit))
    else:
        R, t = hand_eye(A, B, name)
        found = se3.from_parts(R, t[:, 0] / unit)
    apart = se3.difference(found, truth.X)
    assert np.linalg.norm(apart[3:]) < 3e-3
    assert np.linalg.norm(apart[:3]) < 1e-3


@with_opencv_4
@pytest.mark.parametrize("name", ["ANDREFF", "LI"])
def test_opencv_does_fail_there(name):
    truth, A, B = noisy(planar, 5, 12)
    call, pose = (hand_eye, truth.X) if name == "ANDREFF" else (robot_world, se3.inverse(truth.X))
    try:
        off = np.linalg.norm(call(A, B, name, cv2)[-1] - pose[:3, 3:])
    except cv2.error:
        off = np.inf
    assert off > 0.02


@pytest.mark.parametrize("offset", [0.01, 1e-3, 0.0])
def test_tsai_near_an_answer_of_180_degrees(offset):
    """Eq. (12) as OpenCV has it is off by more than a tenth of a radian here."""

    def layout(rng, count):
        return scene(rng, count, angle=np.pi - offset)

    truth, A, B = noisy(layout, 3, 8)
    R, t = hand_eye(A, B, "TSAI")
    apart = se3.difference(se3.from_parts(R, t[:, 0]), truth.X)
    assert np.linalg.norm(apart[3:]) < 5e-3
    assert np.linalg.norm(apart[:3]) < 1e-3


def test_tsai_with_motions_that_opencv_finds_too_small():
    def layout(rng, count):
        return scene(rng, count, tilt_deg=4.0, angle=1.0)

    truth, A, B = noisy(layout, 3, 8, Noise(1e-4, 1e-5, 1e-4, 1e-5))
    R, _ = hand_eye(A, B, "TSAI")
    assert rotations.angle(R.T @ truth.X[:3, :3]) < 3e-3


@pytest.mark.parametrize("name", SIGNATURES)
def test_signatures(name):
    ours = inspect.signature(getattr(opencv, name)).parameters
    words = re.findall(r"\w+", SIGNATURES[name])
    assert list(ours) == words
    required = re.findall(r"\w+", SIGNATURES[name].partition("[")[0])
    defaults = {word: parameter.default for word, parameter in ours.items()}
    assert [word for word in words if defaults[word] is inspect.Parameter.empty] == required
    assert {defaults[word] for word in words[len(required) : -1]} == {None}
    assert defaults["method"] == 0
    assert {parameter.kind for parameter in ours.values()} == {
        inspect.Parameter.POSITIONAL_OR_KEYWORD
    }


@with_opencv_4
@pytest.mark.parametrize("name", SIGNATURES)
def test_signatures_are_those_of_the_installed_opencv(name):
    assert f"{name}({SIGNATURES[name]})" in getattr(cv2, name).__doc__


@with_opencv_4
def test_constants_are_those_of_the_installed_opencv():
    names = {name for name in dir(cv2) if re.match(r"CALIB_(ROBOT_WORLD_)?HAND_EYE_", name)}
    assert names == {name for name in dir(opencv) if name.startswith("CALIB_")}
    assert all(getattr(cv2, name) == getattr(opencv, name) for name in names)


def as_vectors(A):
    return rotations.log(A[:, :3, :3])


FORMS = {
    "arrays": parts,
    "lists of matrices": lambda T: (list(T[:, :3, :3]), list(T[:, :3, 3:])),
    "tuples": lambda T: (tuple(T[:, :3, :3]), tuple(T[:, :3, 3])),
    "row vectors": lambda T: (list(as_vectors(T)[:, None]), list(T[:, :3, 3])),
    "column vectors": lambda T: (list(as_vectors(T)[:, :, None]), T[:, :3, 3:]),
    "flat vectors": lambda T: (as_vectors(T), T[:, :3, 3]),
    "mixed": lambda T: ([as_vectors(T)[0], *T[1:, :3, :3]], T[:, :3, 3]),
    "single precision": lambda T: tuple(part.astype(np.float32) for part in parts(T)),
}


@pytest.mark.parametrize("module", [opencv, pytest.param(cv2, marks=with_opencv_4)])
@pytest.mark.parametrize("form", FORMS)
def test_forms_of_input(form, module):
    """The same forms are put into OpenCV, so that the list stays honest."""
    _, A, B = noisy(general_scene, 1, 6)
    expected = opencv.calibrateHandEye(*parts(A), *parts(B))
    found = module.calibrateHandEye(*FORMS[form](A), *FORMS[form](B))
    np.testing.assert_allclose(found[0], expected[0], atol=1e-6)
    np.testing.assert_allclose(found[1], expected[1], atol=1e-6)


@pytest.mark.parametrize("module", [opencv, pytest.param(cv2, marks=with_opencv_4)])
def test_output_arguments_are_filled_where_they_fit(module):
    _, A, B = noisy(general_scene, 1, 6)
    expected = opencv.calibrateHandEye(*parts(A), *parts(B))
    R, t = np.zeros((3, 3)), np.zeros((3, 1))
    found = module.calibrateHandEye(*parts(A), *parts(B), R, t)
    assert found[0] is R
    assert found[1] is t
    np.testing.assert_allclose(R, expected[0], atol=1e-9)
    flat = np.zeros(3)
    found = module.calibrateHandEye(*parts(A), *parts(B), t_cam2gripper=flat)
    assert found[1] is flat
    np.testing.assert_allclose(flat, expected[1][:, 0], atol=1e-9)
    for misfit in (np.zeros((3, 3), dtype=np.float32), np.zeros((2, 2))):
        found = module.calibrateHandEye(*parts(A), *parts(B), misfit)
        np.testing.assert_allclose(found[0], expected[0], atol=1e-9)
        assert not misfit.any()


@pytest.mark.parametrize("module", [opencv, pytest.param(cv2, marks=with_opencv_4)])
def test_robot_world_outputs_are_filled(module):
    _, A, B = noisy(general_scene, 1, 6)
    outputs = [np.zeros((3, 3)), np.zeros((3, 1)), np.zeros((3, 3)), np.zeros((3, 1))]
    inverse = parts(se3.inverse(A))
    found = module.calibrateRobotWorldHandEye(*parts(B), *inverse, *outputs, 1)
    assert all(given is got for given, got in zip(outputs, found, strict=True))
    assert_equal(found, robot_world(A, B, "LI"))


def replaced(values, index, value):
    return [*values[:index], value, *values[index + 1 :]]


def bad_calls():
    _, A, B = noisy(general_scene, 1, 4)
    (R, t), (Rc, tc) = map(parts, (A, B))
    R, t, Rc, tc = map(list, (R, t, Rc, tc))
    still = [np.eye(3)] * 4
    turns = [rotations.exp(np.array([0.0, 0.0, 0.3 * i])) for i in range(4)]
    nan = np.array([0.0, np.nan, 1.0])
    return {
        "two stations": ((R[:2], t[:2], Rc[:2], tc[:2]), "at least 3 stations, found 2"),
        "none": (([], [], [], []), "at least 3 stations, found 0"),
        "sides": ((R, t, Rc[:3], tc[:3]), "both sides, found 4 and 3"),
        "lists": ((R, t[:3], Rc, tc), "R_gripper2base, t_gripper2base: .* found 4 and 3"),
        "method": ((R, t, Rc, tc, None, None, 9), r"0 \(tsai-lenz\).* found 9"),
        "negative method": ((R, t, Rc, tc, None, None, -1), "found -1"),
        "shape": ((R, t, replaced(Rc, 2, np.eye(2)), tc), r"R_target2cam\[2\]: .*\(2, 2\)"),
        "four elements": (
            (R, replaced(t, 1, np.zeros(4)), Rc, tc),
            r"t_gripper2base\[1\]: .*\(4,\)",
        ),
        "not finite": ((R, t, Rc, replaced(tc, 3, nan)), r"t_target2cam\[3\]: .*nan"),
        "scaled": ((replaced(R, 0, 2 * R[0]), t, Rc, tc), r"R_gripper2base\[0\]: .* by 3 .* is 8"),
        "mirrored": ((replaced(R, 0, -R[0]), t, Rc, tc), r"R_gripper2base\[0\]: .* is -1"),
        "nothing": ((None, t, Rc, tc), "R_gripper2base: .* found None"),
        "words": ((["a", "b", "c", "d"], t, Rc, tc), "R_gripper2base: .* numbers .*'a'"),
        "no turns": ((still, t, still, tc), "at most one: .* 0 deg"),
        "one axis": ((turns, t, turns, tc), "at most one: .* turn by"),
    }


@pytest.mark.parametrize("name", bad_calls())
def test_bad_arguments_are_refused_with_the_value(name):
    arguments, message = bad_calls()[name]
    with pytest.raises(opencv.CalibrationError, match=message) as caught:
        opencv.calibrateHandEye(*arguments)
    assert isinstance(caught.value, cv2.error)
    assert isinstance(caught.value, HandeyeError)


def test_a_bad_method_of_the_robot_world_function_is_refused():
    _, A, B = noisy(general_scene, 1, 4)
    with pytest.raises(opencv.CalibrationError, match=r"0 \(shah\), 1 \(li\), found 2"):
        opencv.calibrateRobotWorldHandEye(*parts(B), *parts(se3.inverse(A)), method=2)
