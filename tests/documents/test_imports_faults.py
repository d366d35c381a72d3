"""Foreign data with faults, one a row: how they are changed, what is said, and where."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from documents import foreign_files
from documents.foreign_files import BOARD, shots

from handeye_cli.conventions import Setup
from handeye_cli.documents import imports
from handeye_cli.documents.imports import ImportOptions
from handeye_cli.errors import InputError

IN_HAND, TO_HAND = Setup.EYE_IN_HAND, Setup.EYE_TO_HAND


def put(*keys, value):
    def change(data):
        *most, last = keys
        for key in most:
            data = data[key]
        data[last] = value

    return change


def drop(*keys):
    def change(data):
        *most, last = keys
        for key in most:
            data = data[key]
        del data[last]

    return change


FAULTS = [
    ("easy_handeye2", put("samples", 1, "robot", "rotation", "w", value="a"), "found 'a'",
     "samples[1].robot.rotation.w"),
    ("easy_handeye2", put("samples", 1, "robot", "rotation", "w", value=3), "found the norm 3",
     "samples[1].robot"),
    ("easy_handeye2", drop("samples", 2, "tracking"), "expected the key 'tracking'", "samples[2]"),
    ("easy_handeye2", put("samples", value=[]), "found a list of 0", "samples"),
    ("easy_handeye2", put("parameters", "calibration_type", value="both"), "found 'both'",
     "parameters.calibration_type"),
    ("easy_handeye-lists", drop("samples", "camera_marker_samples", "transforms", 0),
     r"as many .* \(4\), found 3", "samples.camera_marker_samples"),
    ("moveit", drop(2, "object_wrt_sensor", 15), "expected 16 numbers, found 15",
     "[2].object_wrt_sensor"),
    ("moveit", put(0, "effector_wrt_world", 0, value=7.0), "away from the nearest rotation",
     "[0].effector_wrt_world"),
    ("moveit", put(0, "effector_wrt_world", 12, value=1.0), r"found \[1.0, 0.0, 0.0, 1.0\]",
     "[0].effector_wrt_world"),
    ("moveit-json", drop(3, 1), "found a list of 1", "[3]"),
    ("opencv-lists", drop("t_target2cam", 3), "4 entries as in R_gripper2base, found 3",
     "t_target2cam"),
    ("opencv-lists", put("R_gripper2base", 1, value=[1, 2]), "found 2 numbers",
     "R_gripper2base[1]"),
    ("opencv-lists", drop("t_gripper2base"), "keys R_gripper2base, R_target2cam, t_target2cam",
     ""),
    ("opencv-samples", drop("samples", 2, "t_gripper2base"), "keys r_gripper2base, r_target",
     "samples[2]"),
    ("robot_cal_tools", put(1, "image", value="images/x.png"), "found no file .*x.png",
     "[1].image"),
    ("robot_cal_tools", put(1, "pose", value=3), "found the number 3", "[1].pose"),
    ("industrial_calibration", put("static_camera", value="no way"), "found 'no way'",
     "static_camera"),
    ("industrial_calibration", put("data", value={}), "found no keys", "data"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "change", "message", "where"), FAULTS)
def test_a_fault_is_told_with_its_place_and_value(changed, name, change, message, where):
    with pytest.raises(InputError, match=message) as caught:
        changed(name, change)
    assert f": {where}" in caught.value.where or not where


FINDERS = [
    ({"type": "DeepTargetFinder"}, "found 'DeepTargetFinder'", "target_finder.type"),
    ({"rows": 2.5}, "found 2.5", "target_finder.rows"),
    ({"chessboard_dim": 0}, "found 0", "target_finder.chessboard_dim"),
    ({"dictionary": 21}, "0 to 20, found the number 21", "target_finder.dictionary"),
    ({"aruco_marker_dim": None}, "found nothing", "target_finder.aruco_marker_dim"),
]


@pytest.mark.parametrize(("keys", "message", "where"), FINDERS)
def test_faults_of_a_target_finder(changed, keys, message, where):
    def change(data):
        data["target_finder"] |= keys

    with pytest.raises(InputError, match=message) as caught:
        changed("industrial_calibration", change, target=None)
    assert caught.value.where.endswith(where)


def test_a_plate_of_discs_lacks_its_diameters(changed):
    """Its columns and rows change places: x of the plate is our y."""

    def change(data):
        kind = {"type": "ModifiedCircleGridTargetFinder", "rows": 7, "cols": 10, "spacing": 0.0254}
        data["target_finder"] = kind

    with pytest.raises(InputError, match=r"spacing of 25\.4 mm") as caught:
        changed("industrial_calibration", change, target=None)
    assert "--target disc-grid:7x10:25.4mm:DIAMETER" in caught.value.hint


CAMERAS = [
    ("<px>60.5</px>", "", "expected <px>, found a mapping with the keys type, py"),
    ("<px>60.5</px>", "<px>wide</px>", "found 'wide'"),
    ("<px>60.5</px>", "<px>-1</px>", "found -1 and 61.25"),
    ("<image_width>64</image_width>", "", "expected <image_width>"),
    ("perspectiveProjWith", "ProjWithKannalaBrandt", "found ProjWithKannalaBrandt"),
    ("<root>", "<root><camera><name>left</name></camera>", "with 2: left, Camera"),
    ("root>", "opencv_storage>", "found <opencv_storage> with 1"),
    ("</root>", "", "not valid XML"),
]


@pytest.mark.parametrize(("old", "new", "message"), CAMERAS)
def test_faults_of_a_camera_file(write, old, new, message):
    path, options = write("visp-images", own_camera=False)
    file = path / "camera.xml"
    file.write_text(file.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=message) as caught:
        imports.read(str(path), options)
    assert "camera.xml" in caught.value.where


def edit(path, old, new):
    path.write_text(path.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")


FOLDERS = [
    (lambda f: (f / "pose_cPo_9.yaml").write_text("data: []"), "pose of the robot", "cPo_9"),
    (lambda f: (f / "pose_fPe_1.yaml").write_text("data: []"), "one file of number 1", "run"),
    (lambda f: (f / "pose_cPo_1.yaml").write_text("rows: 6"), "expected the key 'data'", "cPo_1"),
    (lambda f: edit(f / "pose_cPo_2.yaml", "  - [", "  - [1.0]\n  - ["), "found 7", "cPo_2"),
    (lambda f: (f / "camera.xml").write_text("<a>"), "not valid XML", "camera.xml"),
    (lambda f: [(f / name).touch() for name in ("a_camera.xml", "b_camera.xml")],
     "found a_camera.xml, b_camera.xml", "run"),
]  # fmt: skip


@pytest.mark.parametrize(("spoil", "message", "where"), FOLDERS)
def test_faults_of_a_visp_folder(write, spoil, message, where):
    path, options = write("visp-poses")
    spoil(path)
    with pytest.raises(InputError, match=message) as caught:
        imports.read(str(path), options)
    assert where in caught.value.where


def test_visp_folders_without_a_counterpart(write):
    path, options = write("visp-images")
    (path / "image-3.png").unlink()
    with pytest.raises(InputError, match="expected an image with the same number"):
        imports.read(str(path), options)
    for image in path.glob("image-*"):
        image.unlink()
    with pytest.raises(InputError, match="found neither"):
        imports.read(str(path), options)


TABLES = [
    ("x,y,z,qx,qy,qz,qw,name\n1,2,3,0,0,0,1\n", "expected 8 columns, found 7", "line 2"),
    ("name,x,y,z,qx,qy,qz,qw\n0,1,2,three,0,0,0,1\n", "found 'three'", "line 2: z"),
    ("name,x,y,z,qx,qy,qz,qw\n0,1,2,3,0,0,0,2\n", "found the norm 2", "line 2"),
    ("name,x,y,z,qx,qy,qz,qw\n", "found no row", ""),
    ("x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n", "found only x, y, z", ""),
    ("name,x,y,z\na,1,2,3\n", "qx, qy, qz, qw, or rx, ry, rz, found key, x, y, z", ""),
    ("name,x,x,y,z\na,1,1,2,3\n", "one column for x, found 2", ""),
    ("name,x,y,z,qx,qy,qz,qw\n0,1,2,3,0,0,0,1\n0,1,2,3,0,0,0,1\n", "found '0' after '0'",
     "line 3"),
    ("name,x,y,z,qx,qy,qz,qw\n7,1,2,3,0,0,0,1\n", "such as 7, found .*0.png", ""),
    ("time,x,y,z,qx,qy,qz,qw\n2,1,2,3,0,0,0,1\n1,1,2,3,0,0,0,1\n", "found 1 after 2", "line 3"),
    ("time,x,y,z,qx,qy,qz,qw\nnoon,1,2,3,0,0,0,1\n", "found 'noon'", "line 2: time"),
    ("time,x,y,z,qx,qy,qz,qw\n70,1,2,3,0,0,0,1\n", "timestamps, 70 to 70, found .*0.png", ""),
    ("1 2 3 4 5\n", "found neither", ""),
]  # fmt: skip


@pytest.mark.parametrize(("text", "message", "where"), TABLES)
def test_faults_of_a_table(tmp_path, text, message, where):
    foreign_files.save_pictures(shots(), tmp_path / "rgb", lambda index: f"{index}.png")
    (tmp_path / "poses.csv").write_text(text, encoding="utf-8")
    options = ImportOptions(IN_HAND, BOARD, images=str(tmp_path / "rgb"), folder=tmp_path)
    with pytest.raises(InputError, match=message) as caught:
        imports.read(str(tmp_path / "poses.csv"), options, "trajectory")
    assert f"poses.csv{where and ', '}{where}" in caught.value.where


def test_two_images_of_one_pose(write, tmp_path):
    path, options = write("csv-by-number")
    first = tmp_path / "frames" / "frame_0001.png"
    (tmp_path / "frames" / "right_0001.png").write_bytes(first.read_bytes())
    with pytest.raises(InputError, match=r"frame_0001\.png and frames/right_0001\.png"):
        imports.read(str(path), options)


@pytest.mark.parametrize("other", ["0.png", "./0.png", "../rgb/0.png"])
def test_one_image_of_two_poses(tmp_path, other):
    foreign_files.save_pictures(shots(), tmp_path / "rgb", lambda index: f"{index}.png")
    rows = f"image,x,y,z,qx,qy,qz,qw\n0.png,1,2,3,0,0,0,1\n{other},1,2,4,0,0,0,1\n"
    (tmp_path / "poses.csv").write_text(rows, encoding="utf-8")
    options = ImportOptions(IN_HAND, BOARD, images=str(tmp_path / "rgb"), folder=tmp_path)
    with pytest.raises(InputError, match=f"found '{other}' after '0.png'") as caught:
        imports.read(str(tmp_path / "poses.csv"), options)
    assert caught.value.where.endswith("line 3: image")


def test_two_images_of_one_name(write, tmp_path):
    path, options = write("csv-by-number")
    first = tmp_path / "frames" / "frame_0001.png"
    first.with_suffix(".jpg").write_bytes(first.read_bytes())
    with pytest.raises(InputError, match=r"found frame_0001\.jpg and frame_0001\.png"):
        imports.read(str(path), options)


def test_a_folder_without_images(write, tmp_path):
    path, options = write("csv-by-number")
    (tmp_path / "empty").mkdir()
    for folder, message in (("empty", "found none in it"), ("gone", "No such file")):
        with pytest.raises(InputError, match=message) as caught:
            imports.read(str(path), replace(options, images=str(tmp_path / folder)))
        assert folder in caught.value.where


NPZ = [
    (lambda path: np.savez(path, R_gripper2base=np.array([[1], [1, 2]], dtype=object)),
     "numbers: Object arrays"),
    (lambda path: path.write_bytes(b"PK\x03\x04 and no more"), "numbers: File is not a zip file"),
    (lambda path: np.savez(path, R_gripper2base=np.eye(3)), "found a mapping .* R_gripper2base"),
]  # fmt: skip


@pytest.mark.parametrize(("save", "message"), NPZ)
def test_faults_of_npz_files(tmp_path, save, message):
    path = tmp_path / "data.npz"
    save(path)
    with pytest.raises(InputError, match=message) as caught:
        imports.read(str(path), ImportOptions(setup=IN_HAND), "opencv")
    assert str(path) in caught.value.where


def test_a_picture_that_is_none_cannot_tell_the_size_of_the_camera(write, tmp_path):
    path, options = write("industrial_calibration", own_camera=False)
    (tmp_path / "images/0.png").write_bytes(b"no picture")
    with pytest.raises(InputError, match="found 10 bytes that cannot be decoded"):
        imports.read(str(path), options)
