"""Names of exported frames, the step to the mount link, and what single formats add to the pose."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
import yaml
from documents.samples import calibration
from scipy.spatial.transform import Rotation

from handeye_cli.conventions import Setup
from handeye_cli.documents import cameras, exports
from handeye_cli.documents.exports.numbers import roll_pitch_yaw_of
from handeye_cli.errors import UsageError
from handeye_cli.geometry import rotations, se3
from handeye_cli.records import Camera, ProvenanceStep
from handeye_cli.records.named_transform import NamedTransform

NAMES = {"parent": "tool0", "child": "camera_optical_frame", "required": True}
LINK_T_OPTICAL = se3.from_parts(
    Rotation.from_quat([-0.5, 0.5, -0.5, 0.5]).as_matrix(), np.array([0.0, 0.0175, 0.0125])
)
"""Of a RealSense: z of the optical frame looks along x of the link, to the left of its middle."""


@pytest.fixture
def answer():
    return calibration(np.random.default_rng(11))


def transform(camera=None, **changes):
    return replace(
        NamedTransform("tool0", "camera", np.eye(4), Setup.EYE_IN_HAND, camera=camera), **changes
    )


def flagged(answer, **options):
    step = ProvenanceStep(
        "solve", "1", (), {key.replace("_", "-"): options[key] for key in options}
    )
    return replace(answer, provenance=(*answer.provenance, step))


def test_the_answer_gets_its_names(answer):
    found = exports.named(answer, **NAMES, name="cell_4")
    assert (found.parent, found.child, found.name) == ("tool0", "camera_optical_frame", "cell_4")
    np.testing.assert_array_equal(found.matrix, answer.mount_T_camera.matrix)
    np.testing.assert_array_equal(found.covariance, answer.mount_T_camera.covariance)
    assert found.camera == answer.camera
    assert found.optical


@pytest.mark.parametrize(
    ("setup", "expected"), [(Setup.EYE_IN_HAND, "flange"), (Setup.EYE_TO_HAND, "base_link")]
)
def test_the_parent_is_the_frame_that_the_recording_was_read_with(setup, expected):
    answer = calibration(np.random.default_rng(11), setup)
    answer = flagged(answer, gripper_frame="/flange", base_frame="base_link")
    found = exports.named(answer, parent=None, child="camera", required=True)
    assert found.parent == expected
    found = exports.named(answer, parent="tool0", child="camera", required=True)
    assert found.parent == "tool0"


@pytest.mark.parametrize(
    ("setup", "expected"), [(Setup.EYE_IN_HAND, "gripper"), (Setup.EYE_TO_HAND, "base")]
)
def test_our_own_names_do_where_the_file_has_none(setup, expected):
    answer = calibration(np.random.default_rng(11), setup)
    found = exports.named(answer, parent=None, child=None, required=False)
    assert (found.parent, found.child) == (expected, "camera")


@pytest.mark.parametrize(
    ("changes", "message", "hint"),
    [
        ({"parent": None}, "name of the parent frame, that of the gripper, found none", "--parent"),
        ({"child": None}, "name of the child frame, that of the camera's", "--child"),
        ({"parent": "tool 0"}, "--parent to be the name of a frame, found 'tool 0'", "letters"),
        ({"child": "/camera"}, "--child to be the name of a frame, found '/camera'", "slash"),
        ({"child": '"/><x a="'}, "--child to be the name of a frame", "letters"),
        ({"child": "$(arg)"}, r"found '$(arg)'", "letters"),
        ({"parent": ""}, "--parent to be the name of a frame, found ''", "letters"),
        ({"child": "tool0"}, "--child to differ from the parent, found 'tool0'", "in itself"),
    ],
)
def test_names_that_will_not_do(answer, changes, message, hint):
    with pytest.raises(UsageError) as caught:
        exports.named(answer, **(NAMES | changes))
    assert message in caught.value.message
    assert hint in caught.value.hint


def test_a_point_is_at_the_same_place_by_way_of_the_link(answer):
    optical = exports.named(answer, **NAMES)
    link = exports.at_mount(optical, "camera_link", LINK_T_OPTICAL)
    assert (link.parent, link.child, link.camera) == ("tool0", "camera_link", None)
    point = np.array([0.02, -0.03, 0.4, 1.0])
    np.testing.assert_allclose(
        link.matrix @ (LINK_T_OPTICAL @ point), optical.matrix @ point, atol=1e-15
    )


def test_the_error_of_the_link_is_that_of_the_camera_with_its_lever(answer):
    optical = exports.named(answer, **NAMES)
    far = se3.from_parts(rotations.exp(np.array([0.3, -0.2, 1.0])), np.array([0.5, 0.4, -0.3]))
    sigma = 1e-6  # small against 1, so that to second order nothing is left
    covariance = sigma**2 * np.diag([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    optical = replace(optical, covariance=covariance)
    draws = np.random.default_rng(2).multivariate_normal(np.zeros(6), covariance, 20_000)
    moved = se3.perturb(optical.matrix, draws) @ np.linalg.inv(far)
    link = exports.at_mount(optical, "camera_link", far)
    sampled = np.cov(se3.difference(moved, link.matrix).T)
    L = np.linalg.cholesky(link.covariance)
    scatter = np.linalg.eigvalsh(np.linalg.solve(L, np.linalg.solve(L, sampled).T))
    # eigenvalues of a 6-dimensional Wishart of n samples lie within 1 +- 2 sqrt(6 / n)
    spread = 2.5 * np.sqrt(6 / len(draws))
    assert 1 - spread < scatter[0] <= scatter[-1] < 1 + spread


def test_the_link_has_to_be_another_frame(answer):
    optical = exports.named(answer, **NAMES)
    with pytest.raises(UsageError, match="--mount-frame to differ from the parent, found 'tool0'"):
        exports.at_mount(optical, "tool0", LINK_T_OPTICAL)


@pytest.mark.parametrize("name", ["kalibr", "zivid"])
def test_a_link_is_refused_where_the_optical_frame_is_meant(answer, name):
    link = exports.at_mount(exports.named(answer, **NAMES), "camera_link", LINK_T_OPTICAL)
    with pytest.raises(UsageError, match=f"optical frame for {name}.*mount link 'camera_link'"):
        exports.text(link, name)


def test_an_unknown_format_is_refused_with_the_nearest():
    with pytest.raises(UsageError, match=r"found 'open-cv'.*did you mean opencv"):
        exports.text(transform(), "open-cv")


@pytest.mark.parametrize(
    ("name", "path", "suffix"),
    [
        ("easy-handeye2", "cell.yaml", ".calib"),
        ("easy-handeye", "cell.yml", ".yaml"),
        ("ros2-launch", "cell.launch", ".py"),
        ("moveit", "cell.xml", ".launch"),
    ],
)
def test_a_name_that_its_reader_would_not_find(name, path, suffix):
    with pytest.raises(UsageError, match=rf"ends in \{suffix}, .* found '{path}'"):
        exports.check_ending(name, path)
    exports.check_ending(name, f"cell{suffix}")
    exports.check_ending("urdf", path)


def test_a_namespace_of_ros_has_no_hyphen():
    with pytest.raises(UsageError, match="found 'cell-4'"):
        exports.text(transform(name="cell-4"), "easy-handeye")
    data = yaml.safe_load(exports.text(transform(name="cell_4"), "easy-handeye"))
    assert data["parameters"]["namespace"] == "/cell_4/"


def test_easy_handeye2_keeps_the_name_of_the_file():
    data = yaml.safe_load(exports.text(transform(name="cell-4"), "easy-handeye2"))
    assert data["parameters"]["name"] == "cell-4"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_angles_at_the_lock_are_those_of_the_same_rotation(sign):
    """SciPy warns there and loses one of the two angles; the rotation is all that counts."""
    for off in (0.0, 1e-16, 1e-12, 1e-8, 1e-4):
        pitch = sign * (np.pi / 2 - off)
        R = Rotation.from_euler("xyz", [0.4, pitch, 2.0]).as_matrix()
        found = roll_pitch_yaw_of(se3.from_parts(R, np.zeros(3)))
        again = Rotation.from_euler("xyz", found).as_matrix()
        np.testing.assert_allclose(again, R, rtol=0.0, atol=2e-15)


def test_angles_away_from_the_lock_are_scipys():
    turns = Rotation.from_quat(np.random.default_rng(4).normal(size=(50, 4)))
    for turn in turns:
        found = roll_pitch_yaw_of(se3.from_parts(turn.as_matrix(), np.zeros(3)))
        np.testing.assert_allclose(found, turn.as_euler("xyz"), atol=1e-12)


CAMERAS = [
    Camera(640, 480, 550.5, 551.25, 320.0, 240.0, (0.1, -0.2, 1e-5, 3e-4, 0.05)),
    Camera(640, 480, 550.5, 551.25, 320.0, 240.0, (0.1, -0.2, 1e-5, 3e-4)),
    Camera(640, 480, 550.5, 551.25, 320.0, 240.0, (0.1, -0.2, 1e-5, 3e-4), "equidistant"),
    Camera(640, 480, 5.5, 5.25, 320.0, 24.0, tuple(np.arange(8) / 7), "rational_polynomial"),
]


@pytest.mark.parametrize("camera", CAMERAS)
def test_opencv_gets_all_that_is_known(camera, tmp_path):
    covariance = np.random.default_rng(5).normal(size=(6, 6))
    written = exports.text(transform(camera, covariance=covariance), "opencv")
    storage = cv2.FileStorage(written, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    np.testing.assert_array_equal(storage.getNode("covariance").mat(), covariance)
    K = [[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]]
    np.testing.assert_array_equal(storage.getNode("camera_matrix").mat(), K)
    d = storage.getNode("distortion_coefficients").mat()
    np.testing.assert_array_equal(d, [camera.distortion])
    path = tmp_path / "camera.yml"
    path.write_text(written, encoding="utf-8")
    assert cameras.read(str(path), None).camera == camera


def test_opencv_without_what_is_not_known():
    written = exports.text(transform(), "opencv")
    storage = cv2.FileStorage(written, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    assert storage.getNode("covariance").empty()
    assert storage.getNode("camera_matrix").empty()
    without = exports.text(transform(Camera(640, 480, 5.0, 5.0, 3.0, 2.0)), "opencv")
    storage = cv2.FileStorage(without, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    assert storage.getNode("distortion_coefficients").mat().tolist() == [[0.0] * 4]


def test_kalibr_gets_the_lenses_it_has(tmp_path):
    for camera in CAMERAS[1:3]:
        path = tmp_path / "camchain.yaml"
        path.write_text(exports.text(transform(camera), "kalibr"), encoding="utf-8")
        assert cameras.read(str(path), None).camera == camera
    zero = replace(CAMERAS[0], distortion=(0.1, -0.2, 1e-5, 3e-4, 0.0))
    data = yaml.safe_load(exports.text(transform(zero), "kalibr"))
    assert data["cam0"]["distortion_coeffs"] == [0.1, -0.2, 1e-5, 3e-4]
    plain = replace(CAMERAS[0], distortion=())
    data = yaml.safe_load(exports.text(transform(plain), "kalibr"))
    assert data["cam0"]["distortion_coeffs"] == [0.0] * 4


@pytest.mark.parametrize(
    ("camera", "note"),
    [(CAMERAS[0], "plumb_bob of 0.1, -0.2, 1e-05, 0.0003, 0.05"), (CAMERAS[3], "rational_polyn")],
)
def test_kalibr_is_told_of_a_lens_that_it_has_not(camera, note):
    written = exports.text(transform(camera), "kalibr")
    assert f"# intrinsics left out: Kalibr has no lens {note}" in written
    assert yaml.safe_load(written)["cam0"].keys() == {"T_cam_imu"}
