"""`--camera FILE`: intrinsics of a file of their own win over those of the input."""

import hashlib
import json
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from pictures import shoot
from recording.bags import Robot, ns, write
from recording.ros2 import camera_info

from handeye_cli import documents, given_camera
from handeye_cli.errors import UsageError
from handeye_cli.records import Camera

SAMPLE = Path(__file__).resolve().parents[2] / "sample_data" / "paper-plate"
CHESSBOARD = "chessboard:6x6:5mm"


@pytest.fixture
def shot():
    return shoot(np.random.default_rng(7), 6, sigma_px=0.01)


@pytest.fixture
def features_file(tmp_path, shot):
    """Features without intrinsics."""
    path = tmp_path / "features.yaml"
    documents.write(replace(shot.features, camera=None), str(path))
    return path


def camera_file(path, camera, **others):
    data = {
        "image_width": camera.width,
        "image_height": camera.height,
        "camera_matrix": {
            "rows": 3,
            "cols": 3,
            "data": [camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1],
        },
        "distortion_model": camera.model,
        "distortion_coefficients": {"rows": 1, "cols": 5, "data": list(camera.distortion)},
    }
    path.write_text(yaml.safe_dump(data | others), encoding="utf-8")
    return path


def test_the_flag_gives_the_intrinsics_of_features_that_have_none(
    handeye, features_file, shot, tmp_path
):
    path = camera_file(tmp_path / "camera.yaml", shot.features.camera)
    done = handeye("extrinsics", features_file, "--camera", path)
    assert done.code == 0, done.err
    document = yaml.safe_load(done.out)
    assert document["camera"]["fx"] == shot.features.camera.fx
    for station, truth in zip(document["stations"], shot.camera_T_target, strict=True):
        # centres of discs were measured without a lens, whose distortion moves them a little
        found = np.array(station["camera_T_target"]["translation"])
        assert np.linalg.norm(found - truth[:3, 3]) < 1e-4
    step = document["provenance"][-1]
    assert step["options"] == {"camera": str(path)}
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    assert {"file": str(path), "sha256": digest} in step["inputs"]


def test_the_flag_wins_over_the_input(handeye, shot, tmp_path):
    features = tmp_path / "features.yaml"
    documents.write(shot.features, str(features))
    other = replace(shot.features.camera, fx=1600.0, fy=1590.0)
    done = handeye("extrinsics", features, "--camera", camera_file(tmp_path / "c.yaml", other))
    assert yaml.safe_load(done.out)["camera"]["fx"] == 1600.0


def test_another_camera_moves_the_centres_of_discs_to_where_it_sees_them(shot):
    plain = replace(shot.features.camera, distortion=(0.0,) * 5)
    moved = given_camera.with_camera(shot.features, plain)
    there = [station.observation.pixels for station in moved.stations]
    back = given_camera.with_camera(moved, shot.features.camera)
    for station, before, away in zip(back.stations, shot.features.stations, there, strict=True):
        apart = np.abs(station.observation.pixels - before.observation.pixels)
        # the way there and the way back differ to second order
        assert apart.max() < 1e-2 * np.abs(away - before.observation.pixels).max()


def test_a_contradicting_size_is_refused(handeye, features_file, shot, tmp_path):
    wrong = replace(shot.features.camera, width=1280, height=960)
    done = handeye("solve", features_file, "--camera", camera_file(tmp_path / "c.yaml", wrong))
    assert done.code == 3
    assert "640x480" in done.err
    assert "1280x960" in done.err


def test_size_of_a_recording_is_that_of_its_images(handeye, tmp_path):
    shutil.copytree(SAMPLE / "images", tmp_path / "images")
    document = yaml.safe_load((SAMPLE / "recording.yaml").read_text(encoding="utf-8"))
    given = document.pop("camera")
    document["stations"] = document["stations"][:3]
    recording = tmp_path / "recording.json"
    recording.write_text(json.dumps(document), encoding="utf-8")
    storage = cv2.FileStorage(str(tmp_path / "camera.yml"), cv2.FILE_STORAGE_WRITE)
    K = [[given["fx"], 0.0, given["cx"]], [0.0, given["fy"], given["cy"]], [0.0, 0.0, 1.0]]
    storage.write("K", np.array(K))
    storage.write("D", np.array([given["distortion"]], dtype=float))
    storage.release()
    done = handeye("extract", recording, "--camera", tmp_path / "camera.yml")
    assert done.code == 0, done.err
    found = yaml.safe_load(done.out)
    assert (found["camera"]["width"], found["camera"]["height"]) == (
        given["width"],
        given["height"],
    )
    assert all(station["found"] for station in found["stations"])


def test_a_stations_document_is_refused(handeye, stations_file, tmp_path, shot):
    path = camera_file(tmp_path / "camera.yaml", shot.features.camera)
    done = handeye("solve", stations_file, "--camera", path)
    assert done.code == 2
    assert "--camera cannot act on a stations document" in done.err
    with pytest.raises(UsageError, match="stations document"):
        given_camera.with_camera(documents.read(str(stations_file)), shot.features.camera)


@pytest.fixture(scope="module")
def robot():
    return Robot(stations=2)


def bag(path, robot, camera_infos):
    streams = [*robot.static(), *robot.links(), *robot.images(), *camera_infos]
    return write(path, sorted(streams, key=lambda message: message[0]))


def test_intrinsics_of_a_robots_recording_are_not_looked_at(handeye, robot, tmp_path):
    odd = camera_info(ns(0), "camera_optical", k=(1.0,) * 9, model="no such lens")
    info = (ns(0), "/camera/camera_info", "sensor_msgs/msg/CameraInfo", odd)
    path = bag(tmp_path / "a.mcap", robot, [info])
    flags = ("--setup", "eye-in-hand", "--target", CHESSBOARD)
    assert "'no such lens'" in handeye("extract", path, *flags).err
    camera = Camera(64, 48, 600.0, 610.0, 31.5, 23.5, (0.0,) * 5)
    given = camera_file(tmp_path / "camera.yaml", camera)
    done = handeye("extract", path, *flags, "--camera", given)
    assert done.code == 0, done.err
    assert yaml.safe_load(done.out)["camera"]["fx"] == 600.0
    done = handeye("extract", path, *flags, "--camera", given, "--camera-info-topic", "/c")
    assert done.code == 2
    assert "--camera or --camera-info-topic" in done.err
    wrong = camera_file(tmp_path / "wrong.yaml", replace(camera, width=128))
    done = handeye("extract", path, *flags, "--camera", wrong)
    assert done.code == 3
    assert "64x48" in done.err
    assert "128x48" in done.err
