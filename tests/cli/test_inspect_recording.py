"""`handeye inspect data.mcap`: what is in it, before anything is known of it."""

import json

import numpy as np
import pytest
import yaml
from recording import ros2
from recording.bags import Robot, in_order, ns, write


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
