"""Foreign data in detail: what each format means, and what only the user can say."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from documents import foreign_files
from documents.foreign_files import BOARD, CAMERA, shots
from scipy.spatial.transform import Rotation

from handeye_cli import documents
from handeye_cli.conventions import PoseUnits, QuaternionOrder, RobotPoses, Setup
from handeye_cli.documents import imports
from handeye_cli.documents.imports import ImportOptions
from handeye_cli.errors import InputError, UsageError
from handeye_cli.records import TargetSpec
from handeye_cli.records.line import WrittenRotation

DATA = (Path(__file__).resolve().parents[2] / "../shared/data").resolve()
IN_HAND, TO_HAND = Setup.EYE_IN_HAND, Setup.EYE_TO_HAND


def robot_of(made):
    return np.array([station.base_T_gripper for station in made.record.stations])


# --- what the formats mean


def test_easy_handeye_samples_the_inverse_for_a_camera_beside_the_robot(write):
    path, _ = write("easy_handeye2", TO_HAND)
    first = yaml.safe_load(path.read_text(encoding="utf-8"))["samples"][0]["robot"]
    inside = np.array([first["translation"][axis] for axis in "xyz"])
    T = shots().base_T_gripper[0]
    np.testing.assert_allclose(inside, -T[:3, :3].T @ T[:3, 3])
    made = imports.read(str(path), ImportOptions())
    np.testing.assert_allclose(robot_of(made), shots().base_T_gripper, atol=1e-12)
    assert made.record.setup is TO_HAND
    assert made.record.stations[0].written == WrittenRotation(RobotPoses.BASE_IN_GRIPPER)


def test_flags_win_over_what_the_file_says(write):
    path, _ = write("easy_handeye2", TO_HAND)
    made = imports.read(str(path), ImportOptions(setup=IN_HAND))
    assert made.record.setup is IN_HAND
    np.testing.assert_allclose(robot_of(made), np.linalg.inv(shots().base_T_gripper), atol=1e-12)
    wanted = ImportOptions(robot_poses=RobotPoses.GRIPPER_IN_BASE, pose_units=PoseUnits.MM)
    made = imports.read(str(path), wanted)
    expected = np.linalg.inv(shots().base_T_gripper)
    expected[:, :3, 3] /= 1000
    np.testing.assert_allclose(robot_of(made), expected, atol=1e-12)


def test_easy_handeye_of_ros_1_says_eye_on_hand(changed):
    def change(data):
        data["parameters"] = {"eye_on_hand": False, "robot_base_frame": "base"}

    assert changed("easy_handeye2", change).record.setup is TO_HAND


@pytest.mark.parametrize("setup", Setup)
def test_opencv_says_that_gripper2base_may_be_the_inverse(write, setup):
    path, options = write("opencv-lists", setup)
    found = [each.code for each in imports.read(str(path), options).record.findings]
    assert found == (["gripper2base-as-named"] if setup is TO_HAND else [])
    sure = replace(options, robot_poses=RobotPoses.BASE_IN_GRIPPER)
    made = imports.read(str(path), sure)
    assert made.record.findings == ()
    np.testing.assert_allclose(robot_of(made), np.linalg.inv(shots().base_T_gripper), atol=1e-12)


def test_visp_keeps_a_robot_pose_whose_target_was_not_found(write):
    path, options = write("visp-poses")
    (path / "pose_cPo_2.yaml").unlink()
    stations = imports.read(str(path), options).record.stations
    assert [station.name for station in stations] == ["1", "2", "3", "4"]
    assert stations[1].camera_T_target is None
    assert "pose_cPo_2.yaml" in stations[1].reason


def test_a_robot_pose_whose_target_was_not_found_says_how_it_was_written(write):
    path, options = write("visp-poses")
    (path / "pose_cPo_1.yaml").unlink()
    turned = replace(options, robot_poses=RobotPoses.BASE_IN_GRIPPER)
    first, second, *_ = imports.read(str(path), turned).record.stations
    assert first.camera_T_target is None
    assert first.written == second.written == WrittenRotation(RobotPoses.BASE_IN_GRIPPER)


def test_visp_orders_stations_by_their_numbers(write):
    path, options = write("visp-poses")
    for stem in ("franka_pose_fPe", "pose_cPo"):
        (path / f"{stem}_1.yaml").rename(path / f"{stem}_10.yaml")
    made = imports.read(str(path), options)
    assert [station.name for station in made.record.stations] == ["2", "3", "4", "10"]
    np.testing.assert_allclose(robot_of(made)[-1], shots().base_T_gripper[0], atol=1e-12)


def test_visp_camera_is_that_with_distortion(write):
    path, options = write("visp-images", own_camera=False)
    assert imports.read(str(path), options).record.camera == CAMERA


def test_visp_camera_without_distortion(write):
    path, options = write("visp-images", own_camera=False)
    file = path / "camera.xml"
    text = file.read_text(encoding="utf-8")
    end = text.index("<model><type>perspectiveProjWithDist")
    file.write_text(text[:end] + "</camera></root>", encoding="utf-8")
    found = imports.read(str(path), options).record.camera
    assert found == replace(CAMERA, distortion=())


def test_industrial_calibration_tells_target_camera_and_setup(write):
    path, options = write("industrial_calibration", TO_HAND, own_camera=False, target=None)
    record = imports.read(str(path), options).record
    assert record.setup is TO_HAND
    assert record.camera == replace(CAMERA, distortion=())
    keys = {"columns": 7, "rows": 5, "square_mm": 12.0, "marker_mm": 9.0}
    assert record.target == TargetSpec("charuco", keys | {"dictionary": "DICT_4X4_50"})
    assert [each.code for each in record.findings] == ["no-distortion"]


def test_industrial_calibration_finds_a_grid_of_tags(changed):
    def change(data):
        data["target_finder"] = {
            "type": "ArucoGridTargetFinder", "rows": 5, "cols": 7, "aruco_marker_dim": 0.0254,
            "marker_gap": 0.0063, "dictionary": 20,
        }  # fmt: skip

    target = changed("industrial_calibration", change, target=None).record.target
    keys = {"columns": 7, "rows": 5, "size_mm": 25.4, "gap_mm": 6.3}
    assert target == TargetSpec("aruco-grid", keys | {"dictionary": "DICT_APRILTAG_36h11"})


def test_dictionaries_have_the_numbers_of_opencv():
    import cv2

    from handeye_cli.documents.imports.target_finder import _DICTIONARIES

    assert [getattr(cv2.aruco, name) for name in _DICTIONARIES] == list(range(len(_DICTIONARIES)))


def test_euler_angles_stay_as_they_were_written(write):
    """The diagnosis reads them another way when they do not fit."""
    path, options = write("csv-by-number")
    station = imports.read(str(path), options).record.stations[0]
    angles = Rotation.from_matrix(shots().base_T_gripper[0, :3, :3]).as_euler("ZYX", degrees=True)
    assert station.written.order == "ZYX"
    assert station.written.degrees
    np.testing.assert_allclose(station.written.euler, angles, atol=1e-9)


# --- tables


HEADERS = {
    "timestamp,tx,ty,tz,qx,qy,qz,qw": ",",
    "#timestamp [s],x [m],y [m],z [m],qx,qy,qz,qw": ",",
    "Time;pos_x;pos_y;pos_z;quat_x;quat_y;quat_z;quat_w": ";",
    "stamp\tposition.x\tposition.y\tposition.z\torientation.x\torientation.y\torientation.z\t"
    "orientation.w": "\t",
    "# timestamp tx ty tz qx qy qz qw": " ",
    "%none": " ",
}


@pytest.fixture
def timed(tmp_path):
    """Write a table of times and poses, and images that are called by times."""

    def make(times, images, header="%none", separator=" "):
        (tmp_path / "rgb").mkdir()
        for name in images:
            (tmp_path / "rgb" / name).write_bytes(foreign_files.encode_png(shots().pictures[0]))
        rows = [
            separator.join([time, *map(repr, foreign_files.row(T))])
            for time, T in zip(times, shots().base_T_gripper, strict=False)
        ]
        lines = rows if header.startswith("%") else [header, *rows]
        path = tmp_path / "poses.txt"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        options = ImportOptions(IN_HAND, BOARD, images=str(tmp_path / "rgb"), own_camera=True)
        return path, replace(options, folder=tmp_path)

    return make


@pytest.mark.parametrize("header", HEADERS)
def test_columns_by_their_usual_names(timed, header):
    times = ["1.0", "2.0", "3.0", "4.0"]
    path, options = timed(times, [f"{time}.png" for time in times], header, HEADERS[header])
    made = imports.read(str(path), options)
    np.testing.assert_allclose(robot_of(made), shots().base_T_gripper, atol=1e-12)


def test_quaternions_of_a_table_may_begin_with_w(timed):
    path, options = timed(["1", "2", "3", "4"], ["1.png", "2.png"])
    lines = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
    moved = [[*cells[:4], cells[7], *cells[4:7]] for cells in lines]
    path.write_text("\n".join(map(" ".join, moved)), encoding="utf-8")
    made = imports.read(str(path), replace(options, quaternion_order=QuaternionOrder.WXYZ))
    np.testing.assert_allclose(robot_of(made), shots().base_T_gripper[:2], atol=1e-12)


def test_between_two_rows_the_pose_is_on_the_way(timed):
    """A third of the angle about the axis that leads from one to the other."""
    path, options = timed(["10.00", "10.09"], ["10.03.png"])
    (pose,) = robot_of(imports.read(str(path), options))
    start, end = shots().base_T_gripper[:2]
    turn = Rotation.from_matrix(start[:3, :3].T @ end[:3, :3]).as_rotvec()
    R = start[:3, :3] @ Rotation.from_rotvec(turn / 3).as_matrix()
    np.testing.assert_allclose(pose[:3, :3], R, atol=1e-9)
    np.testing.assert_allclose(pose[:3, 3], (2 * start[:3, 3] + end[:3, 3]) / 3, atol=1e-9)


def test_a_pose_on_the_way_says_how_those_around_it_were_written(timed):
    path, options = timed(["10.00", "10.09"], ["10.03.png"])
    turned = replace(options, robot_poses=RobotPoses.BASE_IN_GRIPPER)
    (station,) = imports.read(str(path), turned).record.stations
    assert station.written == WrittenRotation(RobotPoses.BASE_IN_GRIPPER)


RESTS = "10.00,0,0,0,{},10,20\n10.09,0,0,0,{},10.003,20\n"
TURNS = "10.00,0,0,0,10,10,20\n10.09,0,0,0,40,50,20\n"
ON_THE_WAY = [
    (RESTS.format("-179.999", "179.998"), (-180.0, 10.001, 20)),
    (TURNS, None),
]


@pytest.mark.parametrize(("rows", "angles"), ON_THE_WAY)
def test_euler_angles_on_the_way_are_kept_while_the_robot_rests(timed, rows, angles):
    """Over the seam at half a turn too; where it turns, they are not those of the shortest arc."""
    path, options = timed([], ["10.03.png"])
    path.write_text(f"time,x,y,z,rx,ry,rz\n{rows}", encoding="utf-8")
    (station,) = imports.read(str(path), replace(options, rotation="ZYX:deg")).record.stations
    if angles is None:
        assert station.written is None
    else:
        assert station.written.order == "ZYX"
        np.testing.assert_allclose(station.written.euler, angles, atol=1e-9)
        R = Rotation.from_euler("ZYX", angles, degrees=True).as_matrix()
        np.testing.assert_allclose(station.base_T_gripper[:3, :3], R, atol=1e-6)


def test_images_without_a_pose_are_left_out_and_told(timed):
    """One between rows that are too far apart, one before all, one without a time."""
    images = ["10.0004.png", "15.png", "9.png", "cover.png", "20.png"]
    path, options = timed(["10", "20", "30", "40"], images)
    record = imports.read(str(path), options).record
    assert [station.name for station in record.stations] == ["10.0004", "20"]
    (finding,) = record.findings
    assert finding.code == "images-without-pose"
    assert "3 of 5 images" in finding.message
    assert "rgb/15.png" in finding.message


def test_times_in_nanoseconds_and_seconds_are_the_same(timed):
    path, options = timed(["1305031102.175304", "1305031103.5"], ["1305031103500000000.png"])
    np.testing.assert_allclose(
        robot_of(imports.read(str(path), options))[0], shots().base_T_gripper[1], atol=1e-12
    )


# --- facts that are missing, flags that cannot act


ASKED = [
    ("moveit", {"setup": None}, "where the camera is fixed", "--setup"),
    ("easy_handeye2-untold", {"setup": None}, "where the camera is fixed", "--setup"),
    ("robot_cal_tools", {"target": None}, "what the target is", "--target"),
    ("robot_cal_tools", {"own_camera": False}, "intrinsics", "--camera FILE"),
    ("csv-by-number", {"images": None}, "where the images are", "--images"),
    ("csv-by-number", {"rotation": None}, "rx, ry, rz are", "--rotation"),
    ("csv-with-images", {"folder": Path("elsewhere")}, "inside the folder", "--allow-outside"),
]


@pytest.mark.parametrize(("name", "more", "message", "hint"), ASKED)
def test_what_the_file_does_not_say_is_asked_for(write, name, more, message, hint):
    path, options = write(name)
    with pytest.raises(InputError, match=message) as caught:
        imports.read(str(path), replace(options, **more))
    assert hint in caught.value.hint
    assert str(path) in caught.value.where


IDLE = [
    ("moveit", {"images": "rgb"}, "--images acts on a CSV or TUM table"),
    ("opencv-npz", {"rotation": "xyz"}, "--rotation acts on a CSV"),
    ("visp-poses", {"quaternion_order": QuaternionOrder.WXYZ}, "--quaternion-order acts on"),
    ("csv-with-images", {"rotation": "xyz"}, "the table has quaternions"),
    ("csv-by-number", {"rotation": "xyw"}, "expected rotvec, or three axes .* found 'xyw'"),
]


@pytest.mark.parametrize(("name", "more", "message"), IDLE)
def test_a_flag_that_cannot_act_is_refused(write, name, more, message):
    path, options = write(name, **more)
    with pytest.raises(UsageError, match=message):
        imports.read(str(path), options)


def test_images_elsewhere_are_allowed_on_demand(write, tmp_path):
    folder = tmp_path / "documents"
    path, options = write("csv-with-images", folder=folder, allow_outside=True)
    stations = imports.read(str(path), options).record.stations
    assert stations[2].image.label == "../shots/2.png"
    np.testing.assert_array_equal(stations[2].image.load(), shots().pictures[2])


def test_an_unknown_kind_is_named_with_the_nearest(write):
    path, options = write("moveit")
    with pytest.raises(UsageError, match="found 'movit'") as caught:
        imports.read(str(path), options, "movit")
    assert caught.value.hint == "did you mean moveit?"


def test_a_document_of_ours_needs_no_import(tmp_path):
    path = tmp_path / "stations.yaml"
    path.write_text("schema: handeye/stations/1\nstations: []\n", encoding="utf-8")
    with pytest.raises(InputError, match="handeye/stations/1") as caught:
        imports.read(str(path), ImportOptions())
    assert "need no import" in caught.value.hint


UNKNOWN = {
    "a.yaml": ("robot: {x: 1}", "found a mapping with the keys robot"),
    "b.yaml": ("samples: [", "not valid YAML"),
    "c.bin": ("\x00\x01", "found 2 bytes"),
    "d.csv": ("a,b,c\n1,2,3\n", "found 'a,b,c 1,2,3'"),
}


@pytest.mark.parametrize("name", UNKNOWN)
def test_a_file_of_no_kind_is_described(tmp_path, name):
    text, message = UNKNOWN[name]
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message) as caught:
        imports.read(str(tmp_path / name), ImportOptions())
    assert name in caught.value.where


def test_a_folder_of_no_kind_and_a_missing_file(tmp_path):
    (tmp_path / "notes.txt").touch()
    with pytest.raises(InputError, match="found a folder with 1 files"):
        imports.read(str(tmp_path), ImportOptions())
    with pytest.raises(InputError, match="No such file") as caught:
        imports.read(str(tmp_path / "gone.yaml"), ImportOptions())
    assert "gone.yaml" in caught.value.where


# --- real recordings, put back into the form they were published in


def as_published(name, folder):
    """Write a real set as its tool has it: pose files, and images that stay where they are."""
    source = DATA / name / "recording.yaml"
    data = yaml.safe_load(source.read_text(encoding="utf-8"))
    rows = []
    for index, station in enumerate(data["stations"]):
        pose = station["base_T_gripper"]
        numbers = [*pose["translation"], *pose["quaternion"]]
        keys = ("x", "y", "z", "qx", "qy", "qz", "qw")
        foreign_files.dump(dict(zip(keys, numbers, strict=True)), folder / f"{index}.yaml")
        image = str(source.parent / station["image"])
        rows.append({"pose": f"{index}.yaml", "image": image})
    camera = {key: data["camera"][key] for key in ("fx", "fy", "cx", "cy")}
    static = data["setup"] == "eye-to-hand"
    config = {"data": rows, "intrinsics": camera, "static_camera": static}
    return foreign_files.dump(config, folder / "cal_data.yaml"), documents.read(str(source))


@pytest.mark.parametrize("name", ["rct-10x10", "rct-charuco"])
def test_a_real_set_is_the_recording_that_was_made_of_it(name, tmp_path):
    if not (DATA / name).is_dir():
        pytest.skip(f"the recording {name} is not beside the checkout")
    path, recording = as_published(name, tmp_path)
    options = ImportOptions(target=recording.target, folder=tmp_path, allow_outside=True)
    record = imports.read(str(path), options).record
    assert (record.setup, record.target) == (recording.setup, recording.target)
    assert record.camera == replace(recording.camera, distortion=())
    expected = np.array([station.base_T_gripper for station in recording.stations])
    found = np.array([station.base_T_gripper for station in record.stations])
    np.testing.assert_allclose(found, expected, atol=1e-12)
    ours = [station.image.path.resolve() for station in record.stations]
    assert ours == [station.image.path.resolve() for station in recording.stations]
