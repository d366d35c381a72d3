"""Recordings in several files, and folders as rosbag2 leaves them."""

import os
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import yaml
import zstandard
from recording.bags import PERIOD, START, Robot, ns, write

from handeye_cli import recording
from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError
from handeye_cli.geometry import se3
from handeye_cli.recording import bag_folder

OPTIONS = recording.McapOptions(setup=Setup.EYE_IN_HAND)
STATIONS = 6


@pytest.fixture(scope="module")
def robot():
    return Robot(stations=STATIONS, rate=30.0, image_rate=10.0)


@pytest.fixture(scope="module")
def parts(robot):
    """The robot's messages in three parts; the static transforms are in the first only."""
    messages = robot.messages()
    ends = [START, ns(1.7 * PERIOD), ns(3.2 * PERIOD), ns(99)]
    return [
        [message for message in messages if start <= message[0] < end]
        for start, end in pairwise(ends)
    ]


NAMES = ["take_8.mcap", "take_9.mcap", "take_10.mcap"]


def fill(folder, parts, names=NAMES):
    folder.mkdir(exist_ok=True)
    for name, part in zip(names, parts, strict=True):
        write(folder / name, part)
    return folder


def metadata(names, storage="mcap", **more):
    """Return what rosbag2 writes, so far as it can matter here."""
    information = {
        "version": 9,
        "storage_identifier": storage,
        "duration": {"nanoseconds": 10_000_000_000},
        "starting_time": {"nanoseconds_since_epoch": START},
        "message_count": 1000,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": "/tf",
                    "type": "tf2_msgs/msg/TFMessage",
                    "serialization_format": "cdr",
                    "offered_qos_profiles": "- history: 1\n  depth: 100\n",
                },
                "message_count": 900,
            }
        ],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": names,
        "files": [{"path": name, "message_count": 300} for name in names],
    }
    return yaml.safe_dump({"rosbag2_bagfile_information": information | more})


def read(path):
    return recording.read(str(path), OPTIONS)


def codes(read):
    return [finding.code for finding in read.findings]


def assert_all_stations(read, robot):
    """World is known only from the first file's static transforms."""
    assert len(read.stations) == STATIONS
    for index, station in enumerate(read.stations):
        error = se3.inverse(robot.world_T_wrist(index)) @ station.base_T_gripper
        assert np.abs(error - np.eye(4)).max() < 5 * robot.noise
        assert int(station.image.load()[0, 0]) == 40 + 10 * index


def test_splits_of_a_folder_are_one_recording(tmp_path, parts, robot):
    folder = fill(tmp_path / "bag", parts)
    (folder / "metadata.yaml").write_text(metadata(NAMES))
    found = read(folder)
    assert_all_stations(found, robot)
    (files,) = [each for each in found.findings if each.code == "recording-files"]
    assert files.severity == "info"
    assert files.message == "3 files in this order: take_8.mcap, take_9.mcap, take_10.mcap"


def test_a_pause_may_go_on_in_the_next_file(tmp_path, robot):
    messages = robot.messages()
    middle = ns(2 * PERIOD + 0.5)
    halves = [[m for m in messages if (m[0] < middle) is first] for first in (True, False)]
    assert_all_stations(read(fill(tmp_path / "bag", halves, ["a.mcap", "b.mcap"])), robot)


def test_without_metadata_names_are_sorted_as_people_count(tmp_path, parts, robot):
    folder = fill(tmp_path / "bag", parts)
    (folder / "notes.txt").write_text("the second day")
    (folder / "more.mcap").mkdir()
    assert recording.files_of(str(folder)) == tuple(str(folder / name) for name in NAMES)
    assert_all_stations(read(folder), robot)


def test_the_order_of_metadata_holds(tmp_path, parts):
    folder = fill(tmp_path / "bag", parts)
    (folder / "other.mcap").write_bytes(b"not of this recording")
    order = NAMES[::-1]
    (folder / "metadata.yaml").write_text(metadata(order))
    assert [Path(each).name for each in recording.files_of(str(folder))] == order


def test_paths_in_metadata_stay_in_the_folder(tmp_path, parts):
    """Early versions of rosbag2 wrote the folder's own name before each file's."""
    folder = fill(tmp_path / "bag", parts)
    write(tmp_path / "take_8.mcap", parts[0])
    listed = ["../take_8.mcap", "bag/take_9.mcap", str(tmp_path / "elsewhere/take_10.mcap")]
    (folder / "metadata.yaml").write_text(metadata(listed, version=3))
    assert recording.files_of(str(folder)) == tuple(str(folder / name) for name in NAMES)


def test_files_that_are_missing_are_told_of(tmp_path, parts):
    folder = fill(tmp_path / "bag", parts)
    (folder / "metadata.yaml").write_text(metadata([*NAMES, "take_11.mcap"]))
    (folder / "take_9.mcap").unlink()
    found = read(folder)
    (missing,) = [each for each in found.findings if each.code == "recording-files-missing"]
    assert missing.message == (
        "2 files that metadata.yaml names are not there: take_9.mcap, take_11.mcap"
    )
    assert 3 <= len(found.stations) < STATIONS


def test_files_that_were_cut_are_told_of(tmp_path, parts):
    folder = fill(tmp_path / "bag", parts)
    for name in NAMES[1:]:
        raw = (folder / name).read_bytes()
        (folder / name).write_bytes(raw[: len(raw) // 2])
    (cut,) = [each for each in read(folder).findings if each.code == "recording-cut"]
    assert cut.message.startswith("the ends of 2 files are missing; what comes before")


def test_one_file_needs_no_words(tmp_path, robot):
    folder = fill(tmp_path / "bag", [robot.messages()], ["take_0.mcap"])
    (folder / "metadata.yaml").write_text(metadata(["take_0.mcap"]))
    found = read(folder)
    assert_all_stations(found, robot)
    assert "recording-files" not in codes(found)


def pack(folder, ending):
    for file in list(folder.glob("*.mcap")):
        Path(f"{file}{ending}").write_bytes(zstandard.compress(file.read_bytes()))
        file.unlink()


@pytest.mark.parametrize("ending", [".zstd", ".zst"])
@pytest.mark.parametrize("listed", [True, False])
def test_files_compressed_as_a_whole_are_named(tmp_path, parts, ending, listed):
    folder = fill(tmp_path / "bag", parts)
    pack(folder, ending)
    if listed:
        text = metadata([f"{name}{ending}" for name in NAMES], compression_mode="FILE")
        (folder / "metadata.yaml").write_text(text)
    with pytest.raises(InputError, match="compressed as a whole") as caught:
        read(folder)
    assert caught.value.where.endswith(f".mcap{ending}")
    assert f"zstd -d {caught.value.where}" in caught.value.hint


def test_after_unpacking_the_old_metadata_will_do(tmp_path, parts, robot):
    folder = fill(tmp_path / "bag", parts)
    text = metadata([f"{name}.zstd" for name in NAMES], compression_mode="FILE")
    (folder / "metadata.yaml").write_text(text)
    assert_all_stations(read(folder), robot)


def folder_of(**files):
    def make(folder):
        for name, content in files.items():
            (folder / name.replace("_dot_", ".")).write_bytes(content)

    return make


SQLITE = b"SQLite format 3\0"
REFUSED = {
    "empty": (folder_of(), ["expected MCAP files in a folder", "an empty folder"]),
    "others": (folder_of(notes_dot_txt=b"x"), ["expected MCAP files in a folder", "notes.txt"]),
    "document": (
        folder_of(recording_dot_yaml=b"schema: handeye/recording/1\n"),
        ["expected MCAP files in a folder", "give the document in it: ", "recording.yaml"],
    ),
    "sqlite": (
        folder_of(
            a_dot_db3=SQLITE, metadata_dot_yaml=metadata(["a.db3"], "sqlite3").encode()
        ),
        ["metadata.yaml", "found storage 'sqlite3'", "ros2 bag convert"],
    ),
    "sqlite-alone": (folder_of(a_dot_db3=SQLITE), ["a.db3", "SQLite", "ros2 bag convert"]),
    "nothing-is-there": (
        folder_of(metadata_dot_yaml=metadata(["a.mcap"]).encode(), b_dot_mcap=b""),
        ["none of those that its metadata.yaml names: a.mcap"],
    ),
    "metadata-of-others": (
        folder_of(metadata_dot_yaml=b"name: x\n", a_dot_mcap=b""),
        ["metadata.yaml", "expected the metadata of a rosbag2 recording, found KeyError"],
    ),
    "metadata-empty": (
        folder_of(metadata_dot_yaml=b"", a_dot_mcap=b""),
        ["metadata.yaml", "found TypeError", "order of their names"],
    ),
    "metadata-garbage": (
        folder_of(metadata_dot_yaml=b"\xff\xfe{[", a_dot_mcap=b""), ["metadata.yaml", "found "],
    ),
    "metadata-list": (
        folder_of(metadata_dot_yaml=b"rosbag2_bagfile_information: [1]\n", a_dot_mcap=b""),
        ["metadata.yaml", "found list"],
    ),
    "metadata-without-files": (
        folder_of(metadata_dot_yaml=metadata([], relative_file_paths=5).encode()),
        ["relative_file_paths", "found '5'"],
    ),
    "one-is-none": (
        folder_of(a_dot_mcap=b"", b_dot_mcap=b"x"), ["a.mcap", "found an empty file"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("row", REFUSED)
def test_folders_that_cannot_be_read_say_why(tmp_path, row):
    make, words = REFUSED[row]
    make(tmp_path)
    with pytest.raises(InputError) as caught:
        read(tmp_path)
    assert str(tmp_path) in caught.value.where
    assert [word for word in words if word not in str(caught.value)] == []


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.mcap.zstd", zstandard.compress(b"x"), ["compressed as a whole", "zstd -d"]),
        ("a.db3", SQLITE, ["SQLite", "ros2 bag convert"]),
        ("a.bag", b"#ROSBAG V2.0\n", ["ROS 1 bag", "mcap convert"]),
    ],
)
def test_recordings_of_other_kinds_are_known_and_named(tmp_path, name, content, words):
    (tmp_path / name).write_bytes(content)
    assert recording.is_recording(str(tmp_path / name))
    with pytest.raises(InputError) as caught:
        read(tmp_path / name)
    assert [word for word in words if word not in str(caught.value)] == []


def test_a_folder_is_a_recording(tmp_path):
    assert recording.is_recording(str(tmp_path))
    assert recording.files_of("no-such.mcap") == ("no-such.mcap",)


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is unreadable for root")
def test_a_folder_that_may_not_be_read(tmp_path):
    (tmp_path / "bag").mkdir(mode=0)
    with pytest.raises(InputError, match="cannot read it: Permission denied"):
        read(tmp_path / "bag")


def test_metadata_that_grows_when_it_is_read_is_harmless(tmp_path):
    """Each line names the one before ten times; nothing of it is ever written out."""
    lines = ["a0: &a0 [x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]" for k in range(1, 30)]
    lines += ["rosbag2_bagfile_information:", "  relative_file_paths: *a29"]
    (tmp_path / "metadata.yaml").write_text("\n".join(lines))
    with pytest.raises(InputError, match="expected a list of files") as caught:
        bag_folder.files_of(str(tmp_path))
    assert len(str(caught.value)) < 1000


def test_other_pictures_on_the_same_topic_are_not_taken_for_the_first(tmp_path, parts):
    """A folder of recordings that do not belong together."""
    folder = fill(tmp_path / "bag", parts)
    other = [
        (time, topic, "sensor_msgs/msg/CompressedImage" if "image" in topic else name, payload)
        for time, topic, name, payload in parts[2]
    ]
    write(folder / NAMES[2], other)
    found = read(folder)
    (finding,) = [each for each in found.findings if each.code == "messages-unreadable"]
    assert "expected sensor_msgs/msg/Image as cdr as before" in finding.message
