"""Files of one recording that are named one by one."""

from pathlib import Path

import numpy as np
import pytest
from recording import ros2
from recording.bags import Robot, in_order, ns, pose_numbers, write

from handeye_cli import recording
from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError, UsageError
from handeye_cli.recording import McapOptions
from handeye_cli.recording.several_files import files_of, name_of
from handeye_cli.records.frames import RobotFrames

STATIONS = 4
OPTIONS = McapOptions(setup=Setup.EYE_IN_HAND)


@pytest.fixture(scope="module")
def messages():
    return Robot(stations=STATIONS).messages()


@pytest.fixture(scope="module")
def parts(messages, tmp_path_factory):
    """Three files whose names say nothing, in their order of time."""
    folder = tmp_path_factory.mktemp("parts")
    third = len(messages) // 3
    names = ["m.mcap", "z.mcap", "a.mcap"]
    split = [messages[:third], messages[third : 2 * third], messages[2 * third :]]
    return tuple(write(folder / name, part) for name, part in zip(names, split, strict=True))


@pytest.fixture(scope="module")
def whole(messages, tmp_path_factory):
    return recording.read(write(tmp_path_factory.mktemp("whole") / "a.mcap", messages), OPTIONS)


def assert_same_stations(found, whole):
    assert len(found.stations) == STATIONS
    assert found.camera == whole.camera
    assert found.frames == whole.frames == RobotFrames("world", "wrist", "camera_optical", ns(0.04))
    for one, same in zip(found.stations, whole.stations, strict=True):
        np.testing.assert_array_equal(one.base_T_gripper, same.base_T_gripper)
        np.testing.assert_array_equal(one.image.load(), same.image.load())


def test_files_are_in_the_order_of_their_times(parts):
    assert files_of(tuple(sorted(parts))).paths == parts
    assert recording.files_of(parts[::-1]) == parts


def test_they_are_read_as_one(parts, whole):
    found = recording.read(parts[::-1], OPTIONS)
    assert_same_stations(found, whole)
    (files,) = [each for each in found.findings if each.code == "recording-files"]
    assert files.message == f"3 files in this order: {', '.join(parts)}"
    assert found.stations[0].image.label.startswith(f"{parts[2]} and 2 more, /camera/image_raw at ")


def test_camera_and_robot_may_have_been_recorded_apart(messages, whole, tmp_path):
    def of(kind):
        return [message for message in messages if (message[1][:3] == "/tf") is kind]

    files = write(tmp_path / "camera.mcap", of(False)), write(tmp_path / "robot.mcap", of(True))
    assert_same_stations(recording.read(files, OPTIONS), whole)


def test_a_folder_may_be_one_of_them(messages, whole, tmp_path):
    middle = len(messages) // 2
    (tmp_path / "bag").mkdir()
    write(tmp_path / "bag" / "0.mcap", messages[:middle])
    last = write(tmp_path / "last.mcap", messages[middle:])
    assert_same_stations(recording.read((last, str(tmp_path / "bag")), OPTIONS), whole)


def test_a_file_without_messages_is_the_last(parts, tmp_path):
    empty = write(tmp_path / "empty.mcap", [])
    assert files_of((empty, *parts)).paths == (*parts, empty)


def test_a_file_that_was_cut_has_its_place(parts, tmp_path):
    content = Path(parts[0]).read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(content[: len(content) // 2])
    assert files_of((parts[2], str(cut))).paths == (str(cut), parts[2])


def test_files_missing_from_a_folder_are_told_of(parts, tmp_path):
    (tmp_path / "metadata.yaml").write_text(
        "rosbag2_bagfile_information: {relative_file_paths: [0.mcap, 1.mcap]}"
    )
    (tmp_path / "0.mcap").symlink_to(parts[0])
    found = files_of((str(tmp_path), parts[1])).findings
    assert [each.code for each in found] == ["recording-files", "recording-files-missing"]
    assert "1.mcap" in found[1].message


@pytest.mark.parametrize("other", ["m.mcap", "../{0}/m.mcap", "."])
def test_a_file_that_is_named_twice(parts, tmp_path, other):
    first = tmp_path / "m.mcap"
    first.symlink_to(parts[0])
    again = str(tmp_path / other.format(tmp_path.name))
    with pytest.raises(UsageError, match="found one of them twice") as caught:
        files_of((str(first), again))
    assert str(first) in caught.value.message


@pytest.mark.parametrize(("content", "found"), [(b"", "an empty file"), (b"x: 1", "b'x: 1'")])
def test_a_file_that_is_none_is_named(parts, tmp_path, content, found):
    (tmp_path / "odd.mcap").write_bytes(content)
    with pytest.raises(InputError, match=found) as caught:
        files_of((parts[0], str(tmp_path / "odd.mcap")))
    assert caught.value.where == str(tmp_path / "odd.mcap")


def test_what_they_are_called():
    assert name_of("a.mcap") == name_of(("a.mcap",)) == "a.mcap"
    assert name_of(("b.mcap", "a.mcap", "c.mcap")) == "b.mcap and 2 more"


def test_poses_of_a_topic_leave_the_gripper_without_a_name(tmp_path):
    """A topic's name stands in messages for what it is the pose of, but is no frame."""
    robot = Robot(stations=2)
    poses = []
    for t in np.arange(0.0, robot.duration, 0.01):
        payload = ros2.pose(ns(t), "base", pose_numbers(robot.noisy(robot.lower, t)))
        poses.append((ns(t), "/tcp", "geometry_msgs/msg/PoseStamped", payload))
    path = write(tmp_path / "a.mcap", in_order(poses, robot.images(), robot.infos()))
    found = recording.read(path, OPTIONS).frames
    assert found == RobotFrames("base", "", "camera_optical", ns(0.04))
