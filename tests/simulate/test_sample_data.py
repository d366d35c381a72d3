"""The sample recordings: what their script makes, true within their noise, and small."""

import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from handeye_cli import documents, recording, targets
from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.geometry.star import star_pairs
from handeye_cli.geometry.station_generator import generate_stations, interstation_angles
from handeye_cli.recording import McapOptions

SAMPLE = Path(__file__).resolve().parents[2] / "sample_data"
STATIONS = range(12)
ROLLS = np.radians([0, 25, -20, 35, -30, 10, -15, 20, -35, 30, 5, -25])


def read(folder: Path, name: str):
    return documents.read(str(folder / "paper-plate" / f"{name}.yaml"))


def read_mcap(folder: Path):
    options = McapOptions(setup=Setup.EYE_IN_HAND, target=targets.parse("disc-grid:6x6:5mm:4mm"))
    return recording.read(str(folder / "paper-plate.mcap"), options)


def robot_poses(recorded) -> np.ndarray:
    return np.stack([station.base_T_gripper for station in recorded.stations])


def seen_poses(truth) -> np.ndarray:
    return np.stack([station.camera_T_target for station in truth.stations])


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder in which the script has made the sample again."""
    folder = tmp_path_factory.mktemp("sample")
    for name in ("make.sh", "plan.yaml", "camera.yaml"):
        shutil.copy(SAMPLE / name, folder)
    command = folder / "handeye"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m handeye_cli "$@"\n')
    command.chmod(0o755)
    path = f"{folder}{os.pathsep}{os.environ['PATH']}"
    subprocess.run(["sh", folder / "make.sh"], check=True, env={**os.environ, "PATH": path})
    return folder


@pytest.fixture(scope="module")
def sample():
    return read(SAMPLE, "recording")


@pytest.fixture(scope="module")
def truth():
    return read(SAMPLE, "truth")


def test_folder_and_truth_are_what_the_script_makes(made, sample, truth):
    again, true_again = read(made, "recording"), read(made, "truth")
    assert (again.camera, again.target, again.setup) == (sample.camera, sample.target, sample.setup)
    assert robot_poses(again) == pytest.approx(robot_poses(sample), abs=1e-9)
    assert seen_poses(true_again) == pytest.approx(seen_poses(truth), abs=1e-9)
    assert true_again.mount_T_camera == pytest.approx(truth.mount_T_camera, abs=1e-9)
    for one, other in zip(again.stations, sample.stations, strict=True):
        assert np.abs(one.image.load().astype(int) - other.image.load()).max() <= 1
    used = [(step.inputs, step.options) for step in sample.provenance]
    assert used == [(step.inputs, step.options) for step in again.provenance]


def test_mcap_is_what_the_script_makes_and_tells_the_poses_of_the_folder(made, sample):
    stored, again = read_mcap(SAMPLE), read_mcap(made)
    # a pause takes in the first moments of the motion, in which the robot has hardly moved
    assert robot_poses(stored) == pytest.approx(robot_poses(sample), abs=1e-6)
    assert robot_poses(stored) == pytest.approx(robot_poses(again), abs=1e-9)
    for one, other in zip(stored.stations, again.stations, strict=True):
        assert np.abs(one.image.load().astype(int) - other.image.load()).max() <= 1


def test_plan_is_the_circle_with_the_camera_rolled():
    board = targets.parse("disc-grid:6x6:5mm:4mm")
    centre = targets.build(board).points().mean(axis=0)
    planned = documents.read(str(SAMPLE / "plan.yaml"))
    circle = generate_stations(12, 0.15, math.radians(30.0), centre)
    roll = se3.from_parts(rotations.exp(ROLLS[:, None] * [0.0, 0.0, 1.0]), np.zeros(3))
    places = np.stack([station.target_T_camera for station in planned.stations])
    # of the twelve places on the circle every second is one to verify on
    assert places == pytest.approx(np.concatenate([circle[::2], circle[1::2]]) @ roll, abs=1e-12)
    purposes = [station.purpose for station in planned.stations]
    assert purposes == ["calibrate"] * 6 + ["verify"] * 6


def test_robot_poses_agree_with_the_truth_within_the_noise(sample, truth):
    seen = se3.inverse(truth.mount_T_camera @ seen_poses(truth))
    error = se3.difference(robot_poses(sample), truth.reference_T_target @ seen)
    for part, sigma in (
        (error[:, :3], truth.robot_translation),
        (error[:, 3:], truth.robot_rotation),
    ):
        # Twelve magnitudes of three axes: 36 degrees of freedom, 1e-5 to either side.
        assert 0.27 < np.mean(np.sum(part**2, axis=1)) / sigma**2 < 2.4


def test_camera_sits_as_far_from_the_gripper_as_in_the_paper(truth):
    arm = np.linalg.norm(truth.mount_T_camera[:3, 3])
    assert arm == pytest.approx(9.5 * 0.0254, rel=0.01)


def test_stations_turn_far_from_each_other(truth):
    poses = se3.inverse(seen_poses(truth)[:6])
    assert interstation_angles(poses, star_pairs(6)).min() > math.radians(45.0)


@pytest.mark.parametrize("index", STATIONS)
def test_all_discs_are_inside_and_found_by_opencv(index, sample, truth):
    found, centres = cv2.findCirclesGrid(sample.stations[index].image.load(), (6, 6))
    assert found
    points = se3.transform_points(
        truth.stations[index].camera_T_target, targets.build(sample.target).points()
    )
    expected = project(points, sample.camera.parameters)
    distance = np.linalg.norm(centres.reshape(-1, 1, 2) - expected, axis=-1)
    # OpenCV gives a blob's middle: 0.1 px off at 30 degrees, and up to 0.2 px for single discs.
    assert sorted(distance.argmin(axis=1)) == list(range(36))
    assert distance.min(axis=1).max() < 0.3


def test_sample_is_small():
    files = [path for path in SAMPLE.rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in files) < 5_000_000
