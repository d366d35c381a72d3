"""`handeye plan`: stations around a target, and the robot's way there."""

import numpy as np
import pytest
import yaml
from cli.scene import BASE_T_TARGET, TRUTH
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from handeye_cli.geometry.rotations import matrix_from_quaternion

PLAN = ["plan", "--stations", "7", "--distance", "170mm", "--tilt", "30deg"]


def test_the_papers_circle(handeye):
    done = handeye(*PLAN)
    assert (done.code, done.err) == (0, "")
    document = yaml.safe_load(done.out)
    places = np.array([each["target_T_camera"]["translation"] for each in document["stations"]])
    np.testing.assert_allclose(np.linalg.norm(places, axis=1), 0.17, atol=1e-12)
    assert len(document["pairs"]) == 7
    assert document["provenance"][0]["options"] == {"stations": 7}
    short = handeye("plan", "--stations", "7")
    assert short.out == done.out


def test_the_aim_is_the_targets_centre(handeye):
    done = handeye(*PLAN, "--target", "disc-grid:6x4:5mm:4mm")
    stations = yaml.safe_load(done.out)["stations"]
    places = np.array([each["target_T_camera"]["translation"] for each in stations])
    np.testing.assert_allclose(places.mean(axis=0)[:2], [0.0125, 0.0075], atol=1e-12)


def test_a_calibration_gives_the_robots_poses(handeye, stations_file, tmp_path):
    first = tmp_path / "first.yaml"
    assert handeye("solve", stations_file, "-o", first).code == 0
    done = handeye(*PLAN, "--calibration", first, "--verification", "3")
    document = yaml.safe_load(done.out)
    assert [each["purpose"] for each in document["stations"]] == ["calibrate"] * 7 + ["verify"] * 3
    station = document["stations"][0]
    camera = np.array(station["target_T_camera"]["translation"])
    gripper = np.array(station["base_T_gripper"]["translation"])
    seen = BASE_T_TARGET[:3, :3] @ camera + BASE_T_TARGET[:3, 3]
    assert np.linalg.norm(seen - gripper) == pytest.approx(np.linalg.norm(TRUTH[:3, 3]), abs=1e-3)


def test_a_setup_that_is_not_the_calibrations(handeye, stations_file, tmp_path):
    first = tmp_path / "first.yaml"
    assert handeye("solve", stations_file, "-o", first).code == 0
    done = handeye(*PLAN, "--calibration", first, "--setup", "eye-to-hand")
    assert (done.code, done.out) == (2, "")
    assert "eye-to-hand" in done.err
    assert "eye-in-hand" in done.err


PLATE = "disc-grid:6x6:5mm:4mm"
CAMERA = {"width": 640, "height": 480, "fx": 1250.0, "fy": 1250.0, "cx": 319.5, "cy": 239.5}
GUESS = ["--calibration", "0.05,-0.03,0.12,0,0,0.6,0.8", "--base-T-target", "0.6,0.1,0,1,0,0,0"]


@pytest.fixture
def camera_file(tmp_path, stations_file):
    """A document whose camera is all that counts."""
    document = yaml.safe_load(stations_file.read_text(encoding="utf-8")) | {"camera": CAMERA}
    path = tmp_path / "camera.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return path


def test_the_error_is_predicted_with_the_papers_noise(handeye):
    document = yaml.safe_load(handeye("plan", "--stations", "3").out)
    assert document["noise"] == {
        "robot_rotation_mrad": 1.5,
        "robot_translation_mm": 0.127,
        "camera_rotation_mrad": 1.5,
        "camera_translation_mm": pytest.approx(0.0762),
    }
    assert document["basis"] == {
        "robot": "paper",
        "camera": "paper",
        "mount": "lever",
        "lever_mm": pytest.approx(241.3),
    }
    error = document["predicted_error"]
    assert error["rotation_mrad"] == pytest.approx(2.90, rel=0.06)
    assert error["translation_mm"] == pytest.approx(23.4 * 0.0254, rel=0.06)
    assert set(error["paper"]) > {"rotation_mrad", "translation_mm"}
    assert "circle" not in document


def test_noise_flags_scale_the_prediction(handeye):
    levels = "robot-rotation-mrad robot-translation-mm camera-rotation-mrad camera-translation-mm"
    words = [
        word
        for flag, level in zip(levels.split(), ("0.15", "0.0127", "0.15", "0.00762"), strict=True)
        for word in (f"--{flag}", level)
    ]
    quiet = yaml.safe_load(handeye(*PLAN, *words).out)
    loud = yaml.safe_load(handeye(*PLAN).out)
    for key in ("rotation_mrad", "translation_mm", "rotation_95_mrad", "translation_95_mm"):
        ten_times = 10.0 * quiet["predicted_error"][key]
        assert loud["predicted_error"][key] == pytest.approx(ten_times, rel=1e-6)
    assert quiet["basis"]["robot"] == quiet["basis"]["camera"] == "given"


def test_a_calibration_brings_its_noise(handeye, stations_file, tmp_path):
    first = tmp_path / "first.yaml"
    assert handeye("solve", stations_file, "-o", first).code == 0
    document = yaml.safe_load(handeye(*PLAN, "--calibration", first).out)
    noise = yaml.safe_load(first.read_text(encoding="utf-8"))["noise"]
    assert document["noise"]["robot_rotation_mrad"] == noise["robot_rotation_mrad"]
    assert document["basis"] == {"robot": "calibration", "camera": "calibration",
                                 "mount": "calibration"}  # fmt: skip


def test_guesses_give_the_robots_poses(handeye, tmp_path):
    done = handeye(*PLAN, *GUESS)
    stations = yaml.safe_load(done.out)["stations"]
    target = tmp_path / "target.yaml"
    target.write_text("translation: [0.6, 0.1, 0]\nrotvec: [3.141592653589793, 0, 0]\n")
    same = handeye(*PLAN, *GUESS[:3], target)
    for one, other in zip(stations, yaml.safe_load(same.out)["stations"], strict=True):
        place = one["base_T_gripper"]["translation"]
        assert place == pytest.approx(other["base_T_gripper"]["translation"], abs=1e-12)


def test_the_plate_is_kept_in_view_and_what_it_cost_is_said(handeye, camera_file):
    done = handeye("plan", "--stations", "5", "--distance", "60mm", "--target", PLATE,
                   "--camera", camera_file, "--pixel-noise", "0.05")  # fmt: skip
    assert (done.code, done.err) == (0, "")
    document = yaml.safe_load(done.out)
    assert document["circle"]["allowed"] is False
    assert document["basis"]["camera"] == "pixels"
    moved = document["moved"]
    assert moved
    for each in moved:
        assert each["limits"] == ["view"]
        assert each["translation_mm"] > 0.0
    grid = 0.005 * np.stack([*np.meshgrid(np.arange(6), np.arange(6)), np.zeros((6, 6))], -1)
    for station in document["stations"]:
        pose = station["target_T_camera"]
        R = matrix_from_quaternion(np.array(pose["quaternion"]))
        x, y, z = ((grid.reshape(-1, 3) - pose["translation"]) @ R).T
        u, v = 1250.0 * x / z + 319.5, 1250.0 * y / z + 239.5
        assert min(u.min(), v.min()) >= 12.8
        assert u.max() <= 639 - 12.8
        assert v.max() <= 479 - 12.8


def test_a_box_that_no_station_can_reach(handeye):
    done = handeye(*PLAN, *GUESS, "--box", "5,5,5,6,6,6m")
    assert (done.code, done.out) == (4, "")
    assert "no place keeps the limit box" in done.err
    assert "--box" in done.err


def test_optimized_stations_are_compared_with_the_circle(handeye, tmp_path):
    words = ["plan", "--stations", "3", "--optimize", *GUESS, "-o", tmp_path / "plan.yaml"]
    report = handeye(*words, terminal=True).out
    document = yaml.safe_load((tmp_path / "plan.yaml").read_text(encoding="utf-8"))
    assert document["circle"]["allowed"] is True
    for key in ("rotation_mrad", "translation_mm"):
        assert document["circle"][key] > 1.3 * document["predicted_error"][key]
    assert "the paper's circle: " in report


def test_stations_to_add_to_a_recording(handeye, stations_file):
    done = handeye("plan", "--after", stations_file, "--stations", "2")
    document = yaml.safe_load(done.out)
    assert [each["name"] for each in document["stations"]] == ["10", "11"]
    assert all("base_T_gripper" in each for each in document["stations"])
    first, second = document["gains"]
    assert first["rotation_mrad"] == second["rotation_before_mrad"]
    assert first["rotation_mrad"] < first["rotation_before_mrad"]
    assert document["predicted_error"]["translation_mm"] == second["translation_mm"]
    assert document["provenance"][-1]["options"] == {"stations": 2, "after": str(stations_file)}


def test_table_and_recording_hold_the_poses_in_the_order_of_the_way(handeye, tmp_path):
    table, recording = tmp_path / "plan.csv", tmp_path / "plan.mcap"
    words = [*PLAN, *GUESS, "--shortest-way", "--csv", table, "--mcap", recording]
    done = handeye(*words)
    order = yaml.safe_load(done.out)["order"]
    rows = [line.split(",") for line in table.read_text(encoding="utf-8").splitlines()[1:]]
    assert [row[0] for row in rows] == order
    with recording.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        [(_, _, _, message)] = list(reader.iter_decoded_messages())
    assert message.header.frame_id == "base"
    found = [[each.position.x, each.position.y, each.position.z] for each in message.poses]
    np.testing.assert_array_equal(found, np.array([row[1:4] for row in rows], dtype=float))
    again = handeye(*words)
    assert (again.code, again.out) == (2, "")
    assert "plan.csv" in again.err


@pytest.mark.parametrize(
    ("words", "code", "part"),
    [
        (["--box", "1,2,3mm"], 2, "six lengths, found '1,2,3mm'"),
        (["--box", "5,0,0,1,1,1mm"], 2, "the smaller x first, found 5,0,0,1,1,1mm"),
        (["--depth", "30mm"], 2, "two lengths, found '30mm'"),
        (["--depth", "300,200mm"], 2, "found 300 to 200 mm"),
        (["--cone", "0,0,60deg"], 2, "a direction and an angle, found '0,0,60deg'"),
        (["--cone", "0,0,0,60deg"], 2, "a direction, found 0,0,0,60deg"),
        (["--avoid-axis", "w"], 2, "x, y or z, found 'w'"),
        (["--max-roll", "200deg"], 2, "0 to 180 deg, found 200deg"),
        (["--max-tilt", "81deg"], 2, "0 to 80 deg, found 81deg"),
        (["--reach", "850"], 2, "found '850'"),
        (["--reach", "0mm"], 2, "above 0 mm, found 0 mm"),
        (["--lever", "-1mm"], 2, "at least 0 mm, found -1mm"),
        (["--reach", "850mm"], 2, "--reach limits the gripper"),
        (["--margin-px", "10"], 2, "--margin-px 10 needs"),
        (["--pixel-noise", "0.1"], 2, "0.1 px"),
        (["--calibration", "1,2,3"], 2, "seven numbers, found 3"),
        (["--base-T-target", "0,0,0,0,0,0,1"], 2, "found only base_T_target"),
        (["--after", "x.yaml"], 3, "x.yaml"),
        (["--after", "x.yaml", "--optimize"], 2, "--optimize cannot act on --after"),
        (["--after", "x.yaml", "--tilt", "20deg"], 2, "--tilt cannot act on --after"),
        (["--optimize", "--verification", "8"], 2, "0 to 7 verification stations, found 8"),
    ],
)
def test_flags_that_make_no_sense(handeye, words, code, part):
    done = handeye("plan", "--stations", "7", *words)
    assert (done.code, done.out) == (code, "")
    assert part in done.err


def test_a_camera_without_a_target_and_one_that_is_none(handeye, stations_file, camera_file):
    done = handeye(*PLAN, "--camera", camera_file)
    assert (done.code, done.out) == (2, "")
    assert "--target" in done.err
    done = handeye(*PLAN, "--camera", stations_file, "--target", PLATE)
    assert (done.code, done.out) == (3, "")
    assert "expected a document with a camera" in done.err
    done = handeye(*PLAN, *GUESS[:3], camera_file)
    assert (done.code, done.out) == (3, "")
    assert "expected --base-T-target to be a pose" in done.err


def test_too_many_to_choose_one_by_one(handeye):
    done = handeye("plan", "--stations", "51", "--optimize")
    assert (done.code, done.out) == (2, "")
    assert "at most 50 stations with limits or --optimize, found 51" in done.err


def test_a_picture_is_drawn_beside_the_document(handeye, tmp_path):
    pytest.importorskip("matplotlib")
    words = [*PLAN, "-o", tmp_path / "plan.yaml", "--plot", tmp_path / "plan.png"]
    done = handeye(*words)
    assert (done.code, done.out, done.err) == (0, "", "")
    picture = (tmp_path / "plan.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    again = handeye(*PLAN, "--plot", tmp_path / "plan.png")
    assert (again.code, again.out) == (2, "")
    assert "plan.png: the file exists already" in again.err
    assert handeye(*PLAN, "-q", "--plot", tmp_path / "plan.png", "--force").code == 0
    assert (tmp_path / "plan.png").read_bytes() == picture


def test_a_picture_of_another_format_is_refused_before_the_work(handeye, tmp_path):
    done = handeye(*PLAN, "--plot", tmp_path / "plan.svg", "-o", tmp_path / "plan.yaml")
    assert done.code == 2
    assert "--plot: expected a file that ends in .png, found 'plan.svg'" in done.err
    assert not list(tmp_path.iterdir())
