"""`handeye inspect data.mcap`: what is in it, before anything is known of it."""

import json

import numpy as np
import pytest
import yaml
from recording import ros2
from recording.bags import Robot, in_order, ns, write

from handeye_cli.cli import digests
from handeye_cli.recording import survey

CAMERA = """image_width: 64
image_height: 48
camera_matrix: {rows: 3, cols: 3, data: [60, 0, 32, 0, 60, 24, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
"""


@pytest.fixture(scope="module")
def robot():
    return Robot(stations=2)


def test_a_recording_is_described_without_any_flag(handeye, robot, tmp_path):
    path = write(tmp_path / "a.mcap", robot.messages())
    done = handeye("inspect", path, terminal=True)
    assert done.code == 0, done.err
    assert done.out.startswith("This recording can be read\n")
    assert f"handeye solve {path} --setup WHERE --target SPEC" in done.out
    document = yaml.safe_load(handeye("inspect", path).out)
    assert "setup" not in document
    assert document["stations"] == []
    assert document["recording"]["used"]["frames"][-1] == "wrist"
    assert document["provenance"][0]["inputs"][0]["file"] == path


def test_an_ambiguous_recording_lists_the_choices_and_exits_4(handeye, robot, tmp_path):
    pixels = np.zeros((4, 6), dtype=np.uint8)
    other = (ns(1), "/right/image", "sensor_msgs/msg/Image", ros2.image(ns(1), "right", pixels))
    path = write(tmp_path / "a.mcap", in_order(robot.messages(), [other]))
    output = tmp_path / "out.json"
    flags = ("--target", "chessboard:9x6:2mm", "--setup", "eye-in-hand")
    done = handeye("inspect", path, *flags, "-o", output)
    assert done.code == 4
    assert "/camera/image_raw, /right/image" in done.err
    summary = json.loads(output.read_text())["recording"]
    assert summary["missing"] == [
        {"flag": "--image-topic", "choices": ["/camera/image_raw", "/right/image"]}
    ]
    assert summary["command"].endswith(" ".join([*flags, "--image-topic", "TOPIC"]))


def test_a_flag_for_documents_is_refused(handeye, robot, tmp_path):
    path = write(tmp_path / "a.mcap", robot.messages())
    done = handeye("inspect", path, "--pose-units", "mm")
    assert done.code == 2
    assert "--pose-units acts on a document only" in done.err


@pytest.mark.parametrize("flags", [(), ("--camera", "camera.yaml")])
def test_a_recording_that_can_be_read_is_gone_through_and_hashed_once(
    handeye, robot, tmp_path, monkeypatch, flags
):
    path, taken, hashed = write(tmp_path / "a.mcap", robot.messages()), [], []
    (tmp_path / "camera.yaml").write_text(CAMERA)
    take, digesting = survey.take, digests.digesting
    monkeypatch.setattr(survey, "take", lambda *words: taken.append(words) or take(*words))
    monkeypatch.setattr(
        digests, "digesting", lambda inputs: hashed.append(inputs) or digesting(inputs)
    )
    words = ("--setup", "eye-in-hand", "--target", "chessboard:9x6:2mm")
    named = [str(tmp_path / word) if word.endswith("yaml") else word for word in flags]
    done = handeye("inspect", path, *words, *named, "--workers", 1, "--json")
    # its pictures are blank: it has been read, and the target looked for
    assert "expected the target in at least one image, found it in none of 2" in done.err
    assert len(taken) == len(hashed) == 1


def test_intrinsics_from_two_places_are_refused(handeye, robot, tmp_path):
    path = write(tmp_path / "a.mcap", robot.messages())
    done = handeye("inspect", path, "--camera", "c.yaml", "--camera-info-topic", "/x")
    assert done.code == 2
    assert "expected --camera or --camera-info-topic, found both" in done.err
