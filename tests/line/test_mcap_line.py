"""From a robot's MCAP to the answer: the same as from a document of the same stations."""

import hashlib
import json

import numpy as np
import pytest
import yaml
from line.recordings import SAMPLE, RecordedRobot
from recording import bags

from handeye_cli.conventions import MM, MRAD
from handeye_cli.geometry import rotations

TARGET = ["--target", "disc-grid:6x6:5mm:4mm"]
PLATE = ["--setup", "eye-in-hand", *TARGET]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("mcap-line")


def bag(file, **options):
    """Write a robot's recording once and return its path."""
    if not file.exists():
        bags.write(file, RecordedRobot(**options).messages(), chunk_size=1_000_000)
    return file


@pytest.fixture(scope="module")
def compressed(folder):
    return bag(folder / "compressed.mcap")


def solved(handeye, *words):
    """Return the calibration document of a command line and what it said on stderr."""
    done = handeye("solve", *words, "--json")
    assert done.code == 0, done.err
    return json.loads(done.out), done.err


@pytest.fixture(scope="module")
def truth():
    return yaml.safe_load((SAMPLE / "truth.yaml").read_text())["gripper_T_camera"]


def apart(a, b):
    """Return the angle in mrad and the distance in mm between two poses of documents."""
    R, R0 = (rotations.matrix_from_quaternion(np.array(pose["quaternion"])) for pose in (a, b))
    distance = np.linalg.norm(np.subtract(a["translation"], b["translation"]))
    return float(rotations.angle(R @ R0.T)) / MRAD, float(distance) / MM


def assert_within_prediction(answer, document, truth):
    rotation, translation = apart(answer, truth)
    assert rotation < document["predicted_error"]["rotation_95_mrad"] < 1.0
    assert translation < document["predicted_error"]["translation_95_mm"] < 1.0


@pytest.mark.parametrize("raw", [False, True], ids=["png", "mono8"])
def test_a_recorded_robot_gives_the_answer_of_its_document(handeye, folder, truth, raw):
    file = bag(folder / ("raw.mcap" if raw else "compressed.mcap"), raw=raw)
    document, said = solved(handeye, file, *PLATE)
    assert [station["used"] for station in document["stations"]] == [True] * 12
    answer = document["gripper_T_camera"]
    assert_within_prediction(answer, document, truth)
    expected, _ = solved(handeye, SAMPLE / "recording.yaml")
    rotation, translation = apart(answer, expected["gripper_T_camera"])
    # the mean of fifty samples of 0.02 mm and 0.02 mrad on each axis, at twelve stations
    assert rotation < 0.2
    assert translation < 0.05
    assert "recording-choices" in said
    assert "base 'world', gripper 'tool'" in said


def test_a_camera_beside_the_robot(handeye, folder, truth):
    """The plate in the hand: what was the base of the poses is now the gripper."""
    file = bag(folder / "inverted.mcap", inverted=True)
    document, _ = solved(handeye, file, "--setup", "eye-to-hand", *TARGET)
    assert [station["used"] for station in document["stations"]] == [True] * 12
    assert_within_prediction(document["base_T_camera"], document, truth)


def test_a_recording_without_its_end(handeye, folder, compressed, truth):
    content = compressed.read_bytes()
    file = folder / "cut.mcap"
    file.write_bytes(content[: int(0.8 * len(content))])
    document, said = solved(handeye, file, *PLATE)
    assert 8 <= len(document["stations"]) <= 10
    assert all(station["used"] for station in document["stations"])
    assert_within_prediction(document["gripper_T_camera"], document, truth)
    assert "warning: the end of the recording is missing" in said
    assert "recording-cut" in [finding["code"] for finding in document["diagnosis"]]


def test_a_recording_in_two_files(handeye, folder, compressed):
    """The folder as a whole gives what one file gives; only the first has the static link."""
    messages = RecordedRobot().messages()
    middle = len(messages) // 2
    split = folder / "split"
    split.mkdir()
    names = ["split_0.mcap", "split_1.mcap"]
    for name, part in zip(names, [messages[:middle], messages[middle:]], strict=True):
        bags.write(split / name, part)
    listed = {"storage_identifier": "mcap", "relative_file_paths": names}
    (split / "metadata.yaml").write_text(yaml.safe_dump({"rosbag2_bagfile_information": listed}))
    at_once, _ = solved(handeye, compressed, *PLATE)
    document, said = solved(handeye, split, *PLATE)
    assert "2 files in this order: split_0.mcap, split_1.mcap" in said
    (file,) = document["provenance"][0]["inputs"]
    content = b"".join((split / name).read_bytes() for name in names)
    assert file == {"file": str(split), "sha256": hashlib.sha256(content).hexdigest()}
    for each in (at_once, document):
        del each["provenance"], each["diagnosis"]
    assert document == at_once


def test_the_line_in_steps(handeye, compressed, tmp_path):
    """The documents on the way say the same as the whole line at once."""
    features, stations = tmp_path / "features.yaml", tmp_path / "stations.yaml"
    assert handeye("extract", compressed, *PLATE, "-o", features).code == 0
    assert handeye("extrinsics", features, "-o", stations).code == 0
    stepwise, _ = solved(handeye, stations)
    at_once, _ = solved(handeye, compressed, *PLATE)
    del stepwise["provenance"], at_once["provenance"]
    assert stepwise == at_once
