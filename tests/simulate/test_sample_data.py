"""The sample recording is what its script makes, tells the truth within its noise, and is small."""

import importlib.util
import math
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from handeye_cli import targets
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.geometry.star import star_pairs
from handeye_cli.geometry.station_generator import interstation_angles

SAMPLE = Path(__file__).resolve().parents[2] / "sample_data"
FOLDER = SAMPLE / "paper-plate"


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("make_sample", SAMPLE / "make_sample.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def recording():
    return yaml.safe_load((FOLDER / "recording.yaml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def truth():
    return yaml.safe_load((FOLDER / "truth.yaml").read_text(encoding="utf-8"))


def matrix(pose: dict) -> np.ndarray:
    R = rotations.matrix_from_quaternion(np.array(pose["quaternion"]))
    return se3.from_parts(R, np.array(pose["translation"]))


def test_documents_are_what_the_script_makes(script, recording, truth):
    simulated = script.sample()
    assert flat(recording) == pytest.approx(flat(script.recording_document(simulated)), abs=1e-8)
    assert flat(truth) == pytest.approx(flat(script.truth_document(simulated)), abs=1e-8)


def flat(document) -> dict:
    """Numbers and texts of a document by their path."""
    if isinstance(document, dict):
        items = document.items()
    elif isinstance(document, list):
        items = enumerate(document)
    else:
        return {"": document}
    return {f"{k}.{path}": v for k, part in items for path, v in flat(part).items()}


def test_image_is_what_the_script_draws(script):
    station = script.sample().recording.stations[8]
    stored = cv2.imread(str(FOLDER / station.image.label), cv2.IMREAD_UNCHANGED)
    assert np.abs(station.image.load().astype(int) - stored).max() <= 1


def test_robot_poses_agree_with_the_truth_within_the_noise(recording, truth):
    X, Z = matrix(truth["gripper_T_camera"]), matrix(truth["base_T_target"])
    measured = np.stack([matrix(s["base_T_gripper"]) for s in recording["stations"]])
    seen = np.stack([matrix(s["camera_T_target"]) for s in truth["stations"]])
    error = se3.difference(measured, Z @ np.linalg.inv(X @ seen))
    for part, sigma in (
        (error[:, :3], 1e-3 * truth["noise"]["robot_translation_mm"]),
        (error[:, 3:], 1e-3 * truth["noise"]["robot_rotation_mrad"]),
    ):
        # Twelve magnitudes of three axes: 36 degrees of freedom, 1e-5 to either side.
        assert 0.27 < np.mean(np.sum(part**2, axis=1)) / sigma**2 < 2.4


def test_camera_sits_as_far_from_the_gripper_as_in_the_paper(truth):
    arm = np.linalg.norm(truth["gripper_T_camera"]["translation"])
    assert arm == pytest.approx(9.5 * 0.0254, rel=0.01)


def test_stations_turn_far_from_each_other(truth):
    poses = np.linalg.inv(np.stack([matrix(s["camera_T_target"]) for s in truth["stations"]]))
    assert interstation_angles(poses[:6], star_pairs(6)).min() > math.radians(45.0)


@pytest.mark.parametrize("index", range(12))
def test_all_discs_are_inside_and_found_by_opencv(index, script, recording, truth):
    entry = recording["stations"][index]
    image = cv2.imread(str(FOLDER / entry["image"]), cv2.IMREAD_UNCHANGED)
    found, centres = cv2.findCirclesGrid(image, (6, 6))
    assert found
    pose = matrix(truth["stations"][index]["camera_T_target"])
    points = se3.transform_points(pose, targets.build(script.RIG.target).points())
    expected = project(points, script.RIG.camera.parameters)
    distance = np.linalg.norm(centres.reshape(-1, 1, 2) - expected, axis=-1)
    # OpenCV gives a blob's middle: 0.1 px off at 30 degrees, and up to 0.2 px for single discs.
    assert sorted(distance.argmin(axis=1)) == list(range(36))
    assert distance.min(axis=1).max() < 0.3


def test_sample_is_small():
    files = [path for path in SAMPLE.rglob("*") if path.is_file() and path.suffix != ".pyc"]
    assert sum(path.stat().st_size for path in files) < 2_300_000
