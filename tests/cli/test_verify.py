"""`handeye verify`: the paper's protocol, an existing answer, and the limits."""

import json

import numpy as np
import pytest
import yaml
from cli.scene import stations_document

from handeye_cli.geometry import rotations


def test_one_row_for_each_count(handeye, stations_file):
    done = handeye("verify", stations_file, "--stations", "3,4, 5")
    assert done.code == 0
    rows = yaml.safe_load(done.out)["rows"]
    assert [row["stations"] for row in rows] == [3, 4, 5]
    assert [len(row["errors"]) for row in rows] == [3, 4, 5]


def test_half_of_the_stations_without_the_flag(handeye, stations_file):
    (row,) = yaml.safe_load(handeye("verify", stations_file).out)["rows"]
    assert row["stations"] == 5
    assert [error["name"] for error in row["errors"]] == ["05", "06", "07", "08", "09"]


def test_more_stations_than_there_are(handeye, stations_file):
    done = handeye("verify", stations_file, "--stations", "4,6")
    assert (done.code, done.out) == (2, "")
    assert "found 6" in done.err


@pytest.fixture
def new_stations(tmp_path):
    path = tmp_path / "new.json"
    path.write_text(json.dumps(stations_document(7, seed=6)), encoding="utf-8")
    return path


def test_an_existing_calibration_on_new_stations(handeye, calibration_file, new_stations):
    done = handeye("verify", new_stations, "--calibration", calibration_file)
    assert done.code == 0, done.err
    document = yaml.safe_load(done.out)
    (row,) = document["rows"]
    assert len(row["errors"]) == 7
    # One pose of the robot and one of the camera, 0.2 mrad and 0.1 mm each, and the answer's part.
    assert 0.1 < row["rotation_mrad"] < 0.6
    assert 0.05 < row["translation_mm"] < 0.4
    files = [each["file"] for each in document["provenance"][-1]["inputs"]]
    assert files == [str(new_stations), str(calibration_file)]


def test_leave_one_out(handeye, stations_file):
    done = handeye("verify", stations_file, "--leave-one-out", "--strict")
    assert (done.code, done.err) == (0, "")
    document = yaml.safe_load(done.out)
    assert document["protocol"] == "leave-one-out"
    (row,) = document["rows"]
    assert row["stations"] == 9
    assert len(row["errors"]) == 10
    assert row["consistent"] is True


def test_a_calibration_predicts_its_errors(handeye, calibration_file, new_stations):
    done = handeye("verify", new_stations, "--calibration", calibration_file, "--strict")
    assert (done.code, done.err) == (0, "")
    document = yaml.safe_load(done.out)
    assert document["protocol"] == "calibration"
    (row,) = document["rows"]
    assert row["predicted_rotation_mrad"] == pytest.approx(row["rotation_mrad"], rel=0.7)
    assert row["consistent"] is True


def test_a_moved_target(handeye, calibration_file, tmp_path):
    document = stations_document(7, seed=6)
    for station in document["stations"]:
        pose = station["camera_T_target"]
        turned = rotations.matrix_from_quaternion(np.array(pose["quaternion"]))
        pose["translation"] = (pose["translation"] + turned @ [0.03, 0.0, 0.0]).tolist()
    path = tmp_path / "moved.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    words = ["verify", path, "--calibration", calibration_file, "--strict"]
    done = handeye(*words)
    assert done.code == 6
    assert "[target-moved]" in done.err
    assert "say --target-moved" in done.err
    done = handeye(*words, "--target-moved")
    assert done.code == 0
    assert "[target-placed-anew]" in done.err
    assert yaml.safe_load(done.out)["protocol"] == "calibration-moved-target"


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (["--stations", "3", "--leave-one-out"], "--stations and --leave-one-out exclude each"),
        (["--leave-one-out", "--calibration", "c.yaml"], "--leave-one-out and --calibration excl"),
        (["--stations", "3", "--calibration", "c.yaml"], "--stations and --calibration exclude"),
        (["--target-moved"], "--target-moved acts on --calibration only"),
    ],
)
def test_flags_that_do_not_go_together(handeye, stations_file, flags, message):
    done = handeye("verify", stations_file, *flags)
    assert (done.code, done.out) == (2, "")
    assert message in done.err


@pytest.mark.parametrize(
    ("flag", "limit", "unit"),
    [("--max-rotation-mrad", "0.001", "mrad"), ("--max-translation-mm", "0.002", "mm")],
)
def test_a_limit_that_is_missed(handeye, stations_file, flag, limit, unit):
    done = handeye("verify", stations_file, flag, limit)
    assert done.code == 6
    assert "calibrated on 5 stations: expected a" in done.err
    assert f"up to {limit} {unit}, found 0." in done.err
    assert yaml.safe_load(done.out)["rows"], "the result is shown all the same"


def test_limits_that_are_kept(handeye, stations_file):
    limits = ["--max-rotation-mrad", "5", "--max-translation-mm", "5", "--strict"]
    done = handeye("verify", stations_file, *limits)
    assert (done.code, done.err) == (0, "")
