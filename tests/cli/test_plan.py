"""`handeye plan`: stations around a target, and the robot's way there."""

import numpy as np
import pytest
import yaml
from cli.scene import BASE_T_TARGET, TRUTH

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
