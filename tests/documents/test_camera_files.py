"""Intrinsics from the files of other tools, written by those tools or as they write them."""

import hashlib
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from handeye_cli import documents
from handeye_cli.conventions import Setup
from handeye_cli.documents import cameras
from handeye_cli.errors import InputError
from handeye_cli.records import Camera, Features, TargetSpec

K = np.array([[550.25, 0.0, 320.5], [0.0, 551.75, 240.125], [0.0, 0.0, 1.0]])
D = (0.1, -0.2, 1e-05, 3e-4, 0.05)
SIZE = (640, 480)
CAMERA = Camera(*SIZE, K[0, 0], K[1, 1], K[0, 2], K[1, 2], D)

ROS = """image_width: 640
image_height: 480
camera_name: 00b09d01
camera_matrix:
  rows: 3
  cols: 3
  data: [550.25, 0, 320.5, 0, 551.75, 240.125, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.1, -0.2, 1e-05, 3e-4, 0.05]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [500, 0, 300, 0, 0, 500, 200, 0, 0, 0, 1, 0]
"""
ECHOED = """header:
  stamp: {sec: 12, nanosec: 5}
  frame_id: camera_optical
height: 480
width: 640
distortion_model: plumb_bob
d:
- 0.1
- -0.2
- 1.0e-05
- 0.0003
- 0.05
k: [550.25, 0.0, 320.5, 0.0, 551.75, 240.125, 0.0, 0.0, 1.0]
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
binning_x: 0
---
"""
KALIBR = """cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [0.1, -0.2, 1e-05, 3e-4]
  distortion_model: radtan
  intrinsics: [550.25, 551.75, 320.5, 240.125]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
cam1:
  camera_model: pinhole
  distortion_coeffs: [-0.01, 0.05, -0.04, 0.01]
  distortion_model: equidistant
  intrinsics: [461.6, 460.1, 362.6, 246.0]
  resolution: [752, 480]
cam2:
  camera_model: omni
  distortion_coeffs: [-0.3, 0.1, 5e-4, 5e-4]
  distortion_model: radtan
  intrinsics: [0.8, 833.0, 830.3, 373.8, 253.7]
"""


@pytest.fixture
def file(tmp_path):
    def make(text, name="camera.yaml"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return str(path)

    return make


@pytest.fixture
def refused(file):
    """Return the error of reading a text as a camera file."""

    def make(text, suffix="", image_size=None, name="camera.yaml"):
        path = file(text, name)
        with pytest.raises(InputError) as caught:
            cameras.read(path + suffix, image_size)
        assert Path(path).name in str(caught.value)
        return caught.value

    return make


def test_ros_calibration(file):
    read = cameras.read(file(ROS), SIZE)
    assert read.camera == CAMERA
    assert read.sha256 == hashlib.sha256(ROS.encode()).hexdigest()


def test_ros_calibration_without_a_model_is_plumb_bob(file):
    text = ROS.replace("distortion_model: plumb_bob\n", "")
    assert cameras.read(file(text), None).camera == CAMERA


def test_ros_fisheye(file):
    text = ROS.replace("plumb_bob", "equidistant").replace(", 3e-4, 0.05]", ", 3e-4]")
    read = cameras.read(file(text), None).camera
    assert (read.model, read.distortion) == ("equidistant", (0.1, -0.2, 1e-05, 3e-4))


def test_a_message_as_ros_prints_it(file):
    assert cameras.read(file(ECHOED), None).camera == CAMERA


def write_storage(path, entries, size=None):
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("calibration_time", "Tue 3 o'clock")
    for name, value in entries.items():
        storage.write(name, value)
    if size:
        storage.startWriteStruct("image_size", cv2.FileNode_SEQ | cv2.FileNode_FLOW)
        for side in size:
            storage.write("", side)
        storage.endWriteStruct()
    storage.release()
    return str(path)


@pytest.mark.parametrize("ending", ["yml", "yaml", "xml", "json"])
@pytest.mark.parametrize(
    "names",
    [
        ("camera_matrix", "distortion_coefficients"),
        ("cameraMatrix", "dist_coeffs"),
        ("Camera_Matrix", "Distortion_Coefficients"),
        ("K", "D"),
        ("M1", "D1"),
    ],
)
def test_file_storage_as_opencv_writes_it(tmp_path, ending, names):
    entries = dict(zip(names, (K, np.array([D]).T), strict=True))
    path = write_storage(tmp_path / f"camera.{ending}", entries, SIZE)
    assert cameras.read(path, None).camera == CAMERA


def test_file_storage_of_an_older_opencv(tmp_path):
    path = tmp_path / "camera.yml"
    write_storage(path, {"camera_matrix": K, "dist_coeffs": np.array([D])}, SIZE)
    lines = path.read_text().splitlines()
    path.write_text("\n".join(["%YAML:1.0", *lines[1:]]))
    assert cameras.read(str(path), None).camera == CAMERA


@pytest.mark.parametrize("ending", ["yml", "xml", "json"])
def test_sizes_of_two_numbers_and_of_a_matrix(tmp_path, ending):
    entries = {"camera_matrix": K, "dist_coeffs": np.array([D])}
    two = {"image_width": SIZE[0], "image_height": SIZE[1]}
    path = write_storage(tmp_path / f"two.{ending}", entries | two)
    assert cameras.read(path, None).camera == CAMERA
    matrix = {"imageSize": np.array([SIZE])}
    path = write_storage(tmp_path / f"matrix.{ending}", entries | matrix)
    assert cameras.read(path, None).camera == CAMERA


def test_size_is_that_of_the_images_where_the_file_does_not_say(tmp_path):
    path = write_storage(tmp_path / "a.yml", {"K": K, "D": np.array([D])})
    assert cameras.read(path, SIZE).camera == CAMERA
    with pytest.raises(InputError, match="expected the size of the camera's images") as caught:
        cameras.read(path, None)
    assert "image_width" in caught.value.hint


def test_fisheye_of_opencv(tmp_path):
    entries = {"fisheye_model": 1, "camera_matrix": K, "distortion_coefficients": np.array([D[:4]])}
    read = cameras.read(write_storage(tmp_path / "a.yml", entries), SIZE).camera
    assert read.model == "equidistant"


@pytest.mark.parametrize(
    ("count", "model"),
    [(4, "plumb_bob"), (5, "plumb_bob"), (8, "rational_polynomial"), (12, "rational_polynomial")],
)
def test_number_of_coefficients_tells_the_model(tmp_path, count, model):
    given = np.linspace(0.01, 0.02, count)
    entries = {"K": K, "D": given[None]}
    read = cameras.read(write_storage(tmp_path / "a.xml", entries), SIZE).camera
    assert (read.model, read.distortion) == (model, tuple(given))


def test_tilted_model_without_a_tilt_has_twelve_coefficients(tmp_path):
    given = np.append(np.linspace(0.01, 0.02, 12), [0.0, 0.0])
    path = write_storage(tmp_path / "a.json", {"K": K, "D": given[None]})
    assert cameras.read(path, SIZE).camera.distortion == tuple(given[:12])
    given[12] = 0.25
    path = write_storage(tmp_path / "b.json", {"K": K, "D": given[None]})
    with pytest.raises(InputError, match=r"angles of 0.25 and 0 rad"):
        cameras.read(path, SIZE)


def test_nested_lists_of_a_script(file):
    data = {"camera_matrix": K.tolist(), "dist_coeff": [list(D)]}
    assert cameras.read(file(json.dumps(data), "a.json"), SIZE).camera == CAMERA


def test_camchain_has_a_camera_by_name(file):
    path = file(KALIBR)
    radtan = Camera(*SIZE, 550.25, 551.75, 320.5, 240.125, (0.1, -0.2, 1e-05, 3e-4))
    assert cameras.read(f"{path}#cam0", SIZE).camera == radtan
    fisheye = cameras.read(f"{path}#cam1", None).camera
    assert (fisheye.width, fisheye.model) == (752, "equidistant")


def test_camchain_of_one_camera_needs_no_name(file):
    alone = KALIBR[: KALIBR.index("cam1")]
    assert cameras.read(file(alone), SIZE).camera.fx == 550.25


def test_camchain_without_distortion(file):
    alone = KALIBR[: KALIBR.index("cam1")].replace("radtan", "none")
    bare = alone.replace("[0.1, -0.2, 1e-05, 3e-4]", "[]")
    assert cameras.read(file(bare), SIZE).camera.distortion == ()


def test_several_cameras_are_listed(refused):
    error = refused(KALIBR)
    assert "found 3: cam0, cam1, cam2" in error.message
    assert "#cam0" in error.hint


def test_two_cameras_of_a_stereo_file(tmp_path):
    entries = {"M1": K, "D1": np.array([D]), "M2": 2.0 * K, "D2": np.array([D[:4]])}
    entries["M2"][2, 2] = 1.0
    path = write_storage(tmp_path / "stereo.yml", entries)
    assert cameras.read(f"{path}#M2", SIZE).camera.fx == 2 * K[0, 0]
    assert len(cameras.read(f"{path}#M2", SIZE).camera.distortion) == 4
    with pytest.raises(InputError, match="found 2: M1, M2"):
        cameras.read(path, SIZE)


def test_a_name_with_a_hash_is_a_file_where_there_is_one(file):
    assert cameras.read(file(ROS, "left#1.yaml"), SIZE).camera == CAMERA


def test_unknown_camera_is_named_with_the_nearest(refused):
    error = refused(KALIBR, suffix="#cam")
    assert "found 'cam'; it has: cam0, cam1, cam2" in error.message
    assert "cam" in error.hint


def test_camera_of_our_own_documents(tmp_path):
    covariance = np.diag(np.arange(1.0, 10.0))
    camera = Camera(*SIZE, 550.25, 551.75, 320.5, 240.125, D, covariance=covariance)
    path = str(tmp_path / "features.yaml")
    spec = TargetSpec("chessboard", {"columns": 9, "rows": 6, "square_mm": 20.0})
    documents.write(Features(Setup.EYE_IN_HAND, (), spec, camera), path)
    read = cameras.read(path, SIZE).camera
    assert (read.parameters == camera.parameters).all()
    assert (read.covariance == covariance).all()


@pytest.mark.parametrize("indent", [None, "camera"])
def test_our_own_mapping_alone(file, indent):
    data = {"width": 640, "height": 480, "fx": 550.25, "fy": 551.75, "cx": 320.5, "cy": 240.125}
    data |= {"distortion": list(D)}
    text = json.dumps({indent: data} if indent else data)
    assert cameras.read(file(text, "c.json"), SIZE).camera == CAMERA


def test_other_image_size_is_refused_with_both(refused):
    error = refused(ROS, image_size=(1280, 960))
    assert "1280x960" in error.message
    assert "640x480" in error.message


ENTITIES = """<?xml version="1.0"?>
<!DOCTYPE lolz [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>
<opencv_storage><K>&b;</K></opencv_storage>
"""
DEEP = "<opencv_storage>" + "<a>" * 5000 + "</a>" * 5000 + "</opencv_storage>"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (ROS.replace("plumb_bob", "fisheye62"), ["'fisheye62'", "plumb_bob"]),
        (ROS.replace("plumb_bob", "equidistant"), ["expected 0 or 4 coefficients", "found 5"]),
        (ROS.replace("data: [550.25, 0,", "data: [550.25, 0.5,"), ["550.25, 0.5, 320.5", "matrix"]),
        (ROS.replace("data: [550.25, 0, ", "data: [550.25, "), ["expected 9 numbers, found 8"]),
        (ROS.replace("[550.25, 0", "[-550.25, 0"), ["above 0 px, found -550.25 and 551.75"]),
        (ROS.replace("[550.25", "['550.25'"), ["expected a number, found '550.25'", "[0]"]),
        (ROS.replace("[550.25", "[.nan"), ["finite", "nan"]),
        (ROS.replace("1e-05", "no"), ["expected a number, found 'no'"]),
        (ROS.replace("640", "640.5"), ["640.5 and 480"]),
        (ROS.replace("image_height: 480", "image_height: 0"), ["found 640 and 0"]),
        (ROS + "image_width: 650\n", ["the key 'image_width' was given before, in line 1"]),
        (ROS.replace("distortion_coeff", "distort_coeff"), ["expected distortion coefficients"]),
        (ROS.replace("distortion_model: plumb_bob", "distortion_model: 3"), ["the number 3"]),
        ("a: 1\n", ["expected a file with intrinsics, found a mapping with the keys a"]),
        ("- 1\n", ["expected a file with intrinsics, found a list of 1"]),
        ("", ["found nothing"]),
        ("%YAML:1.0\n---\nK: !!python/object:os.system\n", ["the tag"]),
        ("schema: handeye/camera/1\n", ["handeye/camera/1"]),
        (
            "schema: handeye/stations/1\nsetup: eye-in-hand\nstations: []\n",
            ["stations", "expected"],
        ),
        ("<opencv_storage><K>1 2</K>", ["not valid XML"]),
        ("<robot><K>1 2</K></robot>", ["<opencv_storage>", "<robot>"]),
        ("<opencv_storage><K>1</K><K>2</K></opencv_storage>", ["'K' was given before"]),
        ("<opencv_storage><K>a b</K><D>1</D></opencv_storage>", ["expected a number, found 'a'"]),
        (ENTITIES, ["document type", "lolz"]),
        (DEEP, ["levels of nesting"]),
    ],
)
def test_bad_files_are_refused_with_the_value(refused, text, words):
    error = refused(text)
    for word in words:
        assert word in str(error)


@pytest.mark.parametrize(
    ("suffix", "old", "new", "words"),
    [
        ("#cam2", "", "", ["expected the camera model pinhole, found 'omni'", "cam2.camera_model"]),
        ("#cam1", "equidistant", "fov", ["'fov'", "radtan, equidistant", "cam1.distortion_model"]),
        ("#cam1", "[461.6, ", "[", ["expected 4 numbers, found 3", "cam1.intrinsics"]),
        ("#cam1", "0.05, -0.04, 0.01]", "0.05]", ["expected 0 or 4 coefficients of equidistant"]),
        ("#cam1", "[752, 480]", "[752]", ["expected 2 numbers, found 1", "cam1.resolution"]),
    ],
)
def test_bad_cameras_of_a_camchain(refused, suffix, old, new, words):
    error = refused(KALIBR.replace(old, new) if old else KALIBR, suffix=suffix)
    for word in words:
        assert word in str(error)


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        cameras.read(str(tmp_path / "none.yaml"), None)
