"""Bad input that is more than a faulty key: files, pictures, flags, recordings, motions."""

import copy
import json
import os
import shutil
import threading
from pathlib import Path

import cv2
import numpy as np
import pytest
from line.good_input import write
from line.recordings import SAMPLE
from recording import bags

from handeye_cli.geometry import rotations

EYE = ("--setup", "eye-in-hand")
PLATE = ("--target", "disc-grid:6x6:5mm:4mm")

FILES = {
    "none.yaml": ["none.yaml", "No such file"],
    "none.mcap": ["none.mcap", "No such file"],
    "folder": ["folder", "expected MCAP files in a folder", "an empty folder"],
    "folder.mcap": ["folder.mcap", "expected MCAP files in a folder", "an empty folder"],
    "pipe.mcap": ["pipe.mcap", "found a device or pipe"],
    "pipe": ["pipe", "expected a document, found nothing"],
    "/dev/zero": ["/dev/zero: expected a document of at most 1 MB, found more"],
    "nul\0.yaml": ["embedded null byte"],
}


@pytest.mark.parametrize("command", ["extract", "extrinsics", "solve", "verify"])
@pytest.mark.parametrize("name", FILES)
def test_what_is_no_file(refused, tmp_path, monkeypatch, command, name):
    monkeypatch.setattr("handeye_cli.documents.files.MAX_BYTES", 1_000_000)
    monkeypatch.setattr("handeye_cli.documents.text.MAX_BYTES", 1_000_000)
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder.mcap").mkdir()
    os.mkfifo(tmp_path / "pipe.mcap")
    os.mkfifo(tmp_path / "pipe")
    if name == "pipe":  # without a writer it would rightly be waited for
        threading.Thread(target=(tmp_path / name).write_bytes, args=[b""], daemon=True).start()
    refused([command, tmp_path / name], 3, FILES[name])


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is unreadable for root")
def test_a_file_that_may_not_be_read(refused, tmp_path):
    file = tmp_path / "secret.yaml"
    file.touch(mode=0)
    refused(["solve", file], 3, ["secret.yaml", "Permission denied"])


PNG = (SAMPLE / "images" / "00.png").read_bytes()
SMALL = cv2.imencode(".png", np.zeros((240, 320), dtype=np.uint8))[1].tobytes()
HUGE = PNG[:16] + b"\0\1\0\0" * 2 + PNG[24:]
IMAGES = {
    "missing": (lambda file: None, "No such file"),
    "text": (lambda file: file.write_text("hello"), "found 5 bytes that cannot be decoded"),
    "empty": (lambda file: file.touch(), "found no data"),
    "truncated": (lambda file: file.write_bytes(PNG[:9000]), "9000 bytes that cannot be decoded"),
    "folder": (lambda file: file.mkdir(), "found a folder"),
    "pipe": (os.mkfifo, "found a device or pipe"),
    "other-size": (lambda file: file.write_bytes(SMALL), "of 640x480 as the camera's"),
    "huge": (lambda file: file.write_bytes(HUGE), "found 65536 x 65536"),
}


@pytest.fixture
def small(good, tmp_path):
    """Write a recording of five stations and return its document; `wrong` pictures are spoilt."""

    def make(spoil=None, wrong=()):
        document = good["recording"] | {"stations": good["recording"]["stations"][:5]}
        (tmp_path / "images").mkdir()
        for index, station in enumerate(document["stations"]):
            if index in wrong:
                spoil(tmp_path / station["image"])
            else:
                shutil.copy(SAMPLE / station["image"], tmp_path / station["image"])
        return write(tmp_path / "recording.yaml", document)

    return make


@pytest.mark.parametrize("row", IMAGES)
def test_no_picture_can_be_used(refused, small, row):
    spoil, _ = IMAGES[row]
    refused(["solve", small(spoil, range(5))], 4, ["recording.yaml", "none of 5", "extract"])


@pytest.mark.parametrize("row", IMAGES)
def test_a_picture_that_cannot_be_used_costs_its_station(handeye, impatient, small, row):
    spoil, reason = IMAGES[row]
    done = handeye("solve", small(spoil, [2]), "--json")
    assert done.code == 0, done.err
    stations = json.loads(done.out)["stations"]
    assert [station["used"] for station in stations] == [True, True, False, True, True]
    assert reason in stations[2]["reason"]


@pytest.mark.parametrize("goal", ["/dev/zero", "/etc/passwd"])
def test_a_picture_that_is_a_link_out_of_the_folder(refused, small, goal):
    recording = small(lambda file: file.symlink_to(goal), [2])
    parts = ['stations[2].image (station "02")', f"which is {goal}", "--allow-outside"]
    refused(["extract", recording], 3, parts)


def test_a_picture_that_is_a_link_to_itself(refused, small):
    recording = small(lambda file: file.symlink_to(file), [2])
    refused(["extract", recording], 3, ["stations[2].image", "images/02.png"])


def two(stations):
    del stations[2:]


def none_seen(stations):
    for station in stations:
        del station["camera_T_target"]
        station["reason"] = "fog"


def pure_translation(stations):
    for station in stations:
        for key in ("base_T_gripper", "camera_T_target"):
            station[key]["quaternion"] = stations[0][key]["quaternion"]


def one_axis(stations):
    turns = rotations.exp(np.linspace(0.0, 1.0, len(stations))[:, None] * [0.0, 1.0, 0.0])
    for station, R in zip(stations, turns, strict=True):
        station["base_T_gripper"]["quaternion"] = rotations.quaternion_from_matrix(R).tolist()
        station["camera_T_target"]["quaternion"] = rotations.quaternion_from_matrix(R.T).tolist()


def shifted(stations):
    seen = [station["camera_T_target"] for station in stations]
    for station, pose in zip(stations, seen[1:] + seen[:1], strict=True):
        station["camera_T_target"] = pose


def millimetres(stations):
    for station in stations:
        pose = station["base_T_gripper"]
        pose["translation"] = [1000 * x for x in pose["translation"]]


def unchanged(stations):
    pass


WXYZ = ["--quaternion-order", "wxyz"]
INVERTED = ["--robot-poses", "base-in-gripper"]
MOTIONS = {
    "two": (two, [], ["at least 3 stations with a target pose, found 2 of 2"]),
    "none-seen": (none_seen, [], ["at least 3 stations with a target pose, found 0 of 12"]),
    "pure-translation": (pure_translation, [], ["stations that differ in rotation", "0 deg"]),
    "one-axis": (one_axis, [], ["found only one", "the gripper's y axis"]),
    "shifted": (shifted, [], ["one place later in the list"]),
    "inverted": (unchanged, INVERTED, ["--robot-poses"]),
    "wxyz": (unchanged, WXYZ, ["--quaternion-order"]),
    "millimetres": (millimetres, [], ["m or mm"]),
}
"""What is done to good stations, flags, parts of the message."""


@pytest.mark.parametrize("command", ["solve", "verify"])
@pytest.mark.parametrize("row", MOTIONS)
def test_stations_that_do_not_fit(refused, good, tmp_path, command, row):
    change, flags, parts = MOTIONS[row]
    document = copy.deepcopy(good["stations"])
    change(document["stations"])
    file = write(tmp_path / "in.yaml", document)
    refused([command, file, *flags], 4, ["in.yaml", *parts])


FLAGS = {
    "target-nonsense": (["solve", "*recording", "--target", "nonsense"], 2, ["found 'nonsense'"]),
    "target-without-units": (
        ["solve", "*recording", "--target", "disc-grid:6x6:5:4"], 2, ["one of the units", "'5'"],
    ),
    "target-too-short": (
        ["extract", "*recording", "--target", "disc-grid:6x6"], 2, ["found 'disc-grid:6x6'"],
    ),
    "target-behind-the-poses": (
        ["solve", "*stations", *PLATE], 2, ["--target", "stations document"],
    ),
    "target-of-other-points": (
        ["solve", "*features", "--target", "disc-grid:7x6:5mm:4mm"], 2, ["features document"],
    ),
    "stations-99": (["verify", "*stations", "--stations", "99"], 2, ["3 and 6", "found 99"]),
    "stations-zero": (["verify", "*stations", "--stations", "0"], 2, ["found 0"]),
    "stations-words": (["verify", "*stations", "--stations", "four"], 2, ["found 'four'"]),
    "method": (["solve", "*stations", "--method", "magic"], 2, ["found 'magic'"]),
    "calibration-missing": (
        ["verify", "*stations", "--calibration", "none.yaml"], 3, ["none.yaml", "No such file"],
    ),
    "calibration-of-another-kind": (
        ["verify", "*stations", "--calibration", "*features"], 3,
        ["features.yaml: expected a calibration document, found a features document"],
    ),
    "calibration-of-another-setup": (
        ["verify", "*stations", "--calibration", "*calibration", "--setup", "eye-to-hand"], 2,
        ["setup, eye-in-hand, found eye-to-hand"],
    ),
    "plan-from-stations": (
        ["plan", "--stations", "5", "--calibration", "*stations"], 3,
        ["stations.yaml: expected a calibration document"],
    ),
    "plan-of-two": (["plan", "--stations", "2"], 2, ["at least 3 stations, found 2"]),
    "plan-from-behind": (["plan", "--stations", "5", "--distance", "-1m"], 2, ["found -1000 mm"]),
    "plan-upright": (["plan", "--stations", "5", "--tilt", "90deg"], 2, ["80 deg, found 90 deg"]),
    "mcap-flag": (["solve", "*stations", "--image-topic", "/a"], 2, ["--image-topic acts on"]),
    "intrinsics": (["solve", "*stations", "--calibrate-intrinsics"], 2, ["stations document"]),
}  # fmt: skip
"""The words, `*kind` standing for a good document of that kind; exit code; parts of the message."""


@pytest.mark.parametrize("row", FLAGS)
def test_a_flag_that_cannot_be_followed(refused, good, tmp_path, row):
    words, code, parts = FLAGS[row]
    files = {kind: write(tmp_path / f"{kind}.yaml", data) for kind, data in good.items()}
    words = [files[word[1:]] if word.startswith("*") else word for word in words]
    refused(words, code, parts)


OUTPUTS = {
    "missing-folder": ("none/out.yaml", 3, ["none", "expected an existing folder"]),
    "file-as-folder": ("stations.yaml/out.yaml", 3, ["expected an existing folder"]),
    "existing": ("stations.yaml", 2, ["stations.yaml: the file exists already", "--force"]),
    "folder": ("folder", 2, ["found a folder", "- for stdout"]),
    "device": ("/dev/full", 2, ["/dev/full: expected the name of a file, found a device"]),
    "long-name": ("x" * 300, 3, ["cannot be written: File name too long"]),
    "nul": ("a\0b", 3, ["cannot be written: embedded null byte"]),
}


@pytest.mark.parametrize("row", OUTPUTS)
def test_an_output_that_cannot_be_written(refused, good, tmp_path, row):
    name, code, parts = OUTPUTS[row]
    file = write(tmp_path / "stations.yaml", good["stations"])
    (tmp_path / "folder").mkdir()
    refused(["solve", file], code, parts, write=["-o", tmp_path / name])


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bag")
    path = bags.write(folder / "a.mcap", bags.Robot().messages(), chunk_size=16_000)
    return Path(path).read_bytes()


def flipped(content):
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 0xFF]) + content[middle + 1 :]


MAGIC = b"\x89MCAP0\r\n"
RECORDINGS = {
    "empty": (lambda bag: b"", [*EYE, *PLATE], 3, ["found an empty file"]),
    "only-a-magic": (lambda bag: MAGIC, [*EYE, *PLATE], 3, ["found no channels", "cut off"]),
    "no-content": (lambda bag: MAGIC * 2, [*EYE, *PLATE], 3, ["found no channels at all"]),
    "zeros": (
        lambda bag: MAGIC + bytes(99) + MAGIC, [*EYE, *PLATE], 3, ["byte 8", "opcode 0"],
    ),
    "yaml": (lambda bag: b"schema: x", [*EYE, *PLATE], 3, ["starts with b'schema: '"]),
    "ros-1": (lambda bag: b"#ROSBAG V2.0\n", [*EYE, *PLATE], 3, ["ROS 1 bag", "mcap convert"]),
    "flipped-bit": (flipped, [*EYE, *PLATE], 4, ["a.mcap", "none of 4"]),
    "start-only": (lambda bag: bag[:300], [*EYE, *PLATE], 3, ["expected an image topic", "cut"]),
    "no-setup": (lambda bag: bag, PLATE, 3, ["a.mcap", "give --setup eye-in-hand or eye-to-hand"]),
    "no-target": (lambda bag: bag, EYE, 2, ["target", "--target, such as disc-grid"]),
    "topic": (
        lambda bag: bag, [*EYE, *PLATE, "--image-topic", "/camera/image_rae"], 3,
        ["--image-topic", "found '/camera/image_rae'", "did you mean '/camera/image_raw'?"],
    ),
    "frame": (
        lambda bag: bag, [*EYE, *PLATE, "--gripper-frame", "wrst"], 3,
        ["--gripper-frame", "found 'wrst'", "did you mean 'wrist'?"],
    ),
    "pose-topic": (
        lambda bag: bag, [*EYE, *PLATE, "--pose-topic", "/pose"], 3,
        ["a.mcap", "expected a topic with stamped poses", "/tf_static"],
    ),
    "offset-too-large": (
        lambda bag: bag, [*EYE, *PLATE, "--time-offset", "100s"], 3,
        ["4 pauses without one", "--time-offset"],
    ),
    "offset-without-unit": (
        lambda bag: bag, [*EYE, *PLATE, "--time-offset", "40"], 2, ["found '40'"],
    ),
    "units": (
        lambda bag: bag, [*EYE, *PLATE, "--pose-units", "mm"], 2, ["--pose-units acts on a doc"],
    ),
    "nothing-to-see": (lambda bag: bag, [*EYE, *PLATE], 4, ["a.mcap", "none of 4"]),
}  # fmt: skip
"""The file made of a good one, flags, exit code, parts of the message."""


@pytest.mark.parametrize("row", RECORDINGS)
def test_a_robots_recording_that_cannot_be_used(refused, bag, tmp_path, row):
    make, flags, code, parts = RECORDINGS[row]
    file = tmp_path / "a.mcap"
    file.write_bytes(make(bag))
    refused(["solve", file, *flags], code, parts)


def test_a_document_through_a_pipe_with_a_name(shell, good, tmp_path):
    file = write(tmp_path / "stations.yaml", good["stations"])
    done = shell(f"handeye solve <(cat '{file}') --json")
    assert done.code == 0, done.err
    assert json.loads(done.out)["schema"] == "handeye/calibration/1"


def test_a_broken_picture_is_told_of_once(shell, small):
    """OpenCV is silent; one warning names the station, and the document has the reason."""
    recording = small(lambda file: file.write_bytes(PNG[:20]), [2])
    done = shell(f"handeye extract '{recording}' --json")
    assert done.code == 0
    (warning,) = done.err.splitlines()
    assert warning.startswith("warning: 1 of 5 images are not used: 02: images/02.png: expected")
    assert "20 bytes that cannot be decoded" in json.loads(done.out)["stations"][2]["reason"]
