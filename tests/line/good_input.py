"""Valid documents of every kind a command reads, as plain data, made without pictures."""

import json
from io import BytesIO

import numpy as np
import yaml
from line.recordings import SAMPLE

from handeye_cli import documents, pipeline
from handeye_cli.geometry import rotations

PIXEL_NOISE = 0.02


def documents_of_the_line():
    """The sample's stations as recording, features, stations and calibration."""
    recording = yaml.safe_load((SAMPLE / "recording.yaml").read_text())
    truth = yaml.safe_load((SAMPLE / "truth.yaml").read_text())
    pairs = list(zip(recording["stations"], truth["stations"], strict=True))
    stations = _stations(pairs)
    return {
        "recording": recording,
        "features": _features(recording, pairs),
        "stations": stations,
        "calibration": _calibration(stations),
    }


def _stations(pairs):
    entries = [
        {
            "name": recorded["name"],
            "base_T_gripper": recorded["base_T_gripper"],
            "camera_T_target": true["camera_T_target"],
        }
        for recorded, true in pairs
    ]
    return {"schema": "handeye/stations/1", "setup": "eye-in-hand", "stations": entries}


def _features(recording, pairs):
    """What a camera without distortion sees of the plate."""
    camera = recording["camera"] | {"distortion": []}
    K = np.array([[camera["fx"], 0, camera["cx"]], [0, camera["fy"], camera["cy"]], [0, 0, 1]])
    row, column = np.divmod(np.arange(36), 6)
    points = np.stack([column, row, np.zeros(36)], axis=1) * 0.005
    rng = np.random.default_rng(1989)
    entries = []
    for recorded, true in pairs:
        pose = true["camera_T_target"]
        R = rotations.matrix_from_quaternion(np.array(pose["quaternion"]))
        rays = (points @ R.T + pose["translation"]) @ K.T
        pixels = rays[:, :2] / rays[:, 2:] + rng.normal(0.0, PIXEL_NOISE, (36, 2))
        seen = {"found": True, "ids": list(range(36)), "pixels": pixels.tolist()}
        robot = {"name": recorded["name"], "base_T_gripper": recorded["base_T_gripper"]}
        entries.append(robot | seen)
    head = {"schema": "handeye/features/1", "setup": "eye-in-hand"}
    return head | {"target": recording["target"], "camera": camera, "stations": entries}


def _calibration(stations):
    record = documents.read("-", stdin=BytesIO(json.dumps(stations).encode()))
    steps = pipeline.Steps()
    answer = pipeline.to_calibration(record, steps, method="tsai-lenz", pairs="star")
    return json.loads(documents.dump(answer, "json"))


def write(path, document):
    """Write a document as JSON, with YAML's words for numbers that JSON does not have."""
    text = json.dumps(document).replace("NaN", ".nan").replace("Infinity", ".inf")
    path.write_text(text, encoding="utf-8")
    return path
