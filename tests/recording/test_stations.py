"""Whole recordings of a robot whose stations are known."""

import os
import pickle
import subprocess
import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest
from recording import ros2
from recording.bags import (
    LAYOUTS,
    MOVING_GREY,
    PAUSE,
    PERIOD,
    SIZE,
    K,
    Robot,
    in_order,
    ns,
    pose_numbers,
    write,
)

from handeye_cli import recording
from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError
from handeye_cli.geometry import se3
from handeye_cli.recording import McapOptions
from handeye_cli.records import Camera, TargetSpec

OPTIONS = McapOptions(setup=Setup.EYE_IN_HAND)
STILL = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def codes(record):
    return [finding.code for finding in record.findings]


def errors(record, robot):
    """RMS distance and angle of the stations' poses."""
    way = [
        se3.difference(station.base_T_gripper, robot.world_T_wrist(index))
        for index, station in enumerate(record.stations)
    ]
    return np.sqrt(np.mean(np.square(way), axis=0))


@pytest.fixture(scope="module")
def robot():
    return Robot()


@pytest.fixture(scope="module")
def messages(robot):
    return robot.messages()


@pytest.fixture(scope="module")
def path(tmp_path_factory, messages):
    return write(tmp_path_factory.mktemp("bag") / "robot.mcap", messages)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_pause_is_a_station_in_every_layout(tmp_path, robot, messages, layout):
    record = recording.read(write(tmp_path / "a.mcap", messages, **LAYOUTS[layout]), OPTIONS)
    assert [station.name for station in record.stations] == ["00", "01", "02", "03"]
    # means of at least 50 samples; two links scatter, with a lever of less than a metre
    expected = robot.noise * np.sqrt(2 * (1 + 1.0) / 50)
    assert (errors(record, robot) < 3 * expected).all()
    assert (errors(record, robot) > 0.02 * expected).all()
    greys = [np.unique(station.image.load()).tolist() for station in record.stations]
    assert greys == [[40], [50], [60], [70]]
    assert codes(record) == ["recording-choices", "frames-moving"]


def test_record_carries_what_was_said_and_what_was_found(path):
    target = TargetSpec("disc-grid", {"rows": 6})
    record = recording.read(path, replace(OPTIONS, setup=Setup.EYE_TO_HAND, target=target))
    assert record.setup is Setup.EYE_TO_HAND
    assert record.target == target
    assert record.camera == Camera(
        64, 48, K[0], K[4], K[2], K[5], distortion=(0.1, -0.2, 0.0, 0.0, 0.0)
    )
    assert "base 'world', gripper 'wrist', images /camera/image_raw" in record.findings[0].message


def test_unused_frames_are_counted(path, robot):
    record = recording.read(path, OPTIONS)
    total = len(list(robot.images()))
    unused = next(f for f in record.findings if f.code == "frames-moving").message
    count, of = unused.split()[0:3:2]
    assert int(of) == total
    moving = sum(robot.moving(t) for t in np.arange(0.01, robot.duration, 0.05))
    assert moving <= int(count) <= moving + 4 * 2 * 0.27 * robot.image_rate


def test_frames_of_a_pause_are_averaged(tmp_path, robot):
    def flicker(messages):
        for index, (log, topic, schema, _) in enumerate(messages):
            t = (log - ns(robot.image_delay)) / 1e9
            level = MOVING_GREY if robot.moving(t) else 100 + 20 * (index % 2)
            pixels = np.full(SIZE, level, dtype=np.uint8)
            yield log, topic, schema, ros2.image(ns(t), "camera_optical", pixels)

    mixed = in_order(robot.static(), robot.links(), flicker(robot.images()))
    record = recording.read(write(tmp_path / "a.mcap", mixed), OPTIONS)
    for station in record.stations:
        assert 100 < station.image.load()[0, 0] < 120


def test_images_are_read_lazily_and_travel_to_other_processes(tmp_path, messages):
    file = tmp_path / "a.mcap"
    record = recording.read(write(file, messages), OPTIONS)
    source = pickle.loads(pickle.dumps(record.stations[1].image))
    np.testing.assert_array_equal(source.load(), np.full(SIZE, 50))
    assert source.label.startswith(f"{file}, /camera/image_raw at 1700000001.")
    file.unlink()
    with pytest.raises(InputError, match="No such file"):
        record.stations[0].image.load()


def test_frames_of_different_sizes_are_refused(tmp_path, robot):
    def resized(messages):
        for index, (log, topic, schema, _) in enumerate(messages):
            pixels = np.zeros((4, 6 + (index > 8)), dtype=np.uint8)
            stamp = log - round(robot.image_delay * 1e9)
            yield log, topic, schema, ros2.image(stamp, "camera_optical", pixels)

    mixed = in_order(robot.static(), robot.links(), resized(robot.images()))
    record = recording.read(write(tmp_path / "a.mcap", mixed), OPTIONS)
    with pytest.raises(InputError, match="found 6 x 4, 7 x 4"):
        record.stations[0].image.load()


@pytest.mark.parametrize("layout", ["zstd", "small-chunks", "no-chunks"])
def test_cut_recording_gives_the_stations_before_the_cut(tmp_path, robot, messages, layout):
    file = tmp_path / "a.mcap"
    write(file, messages, **{"chunk_size": 16_000, **LAYOUTS[layout]})
    file.write_bytes(file.read_bytes()[: int(0.8 * file.stat().st_size)])
    record = recording.read(str(file), OPTIONS)
    assert len(record.stations) in {3, 4}
    assert record.findings[0].code == "recording-cut"
    assert (errors(record, robot) < 3 * robot.noise).all()
    assert [s.image.load()[0, 0] for s in record.stations][:3] == [40, 50, 60]


def test_time_offset_is_added_to_the_images(tmp_path):
    early = Robot(stamp_offset=-0.5, image_delay=-0.48)
    path = write(tmp_path / "a.mcap", early.messages())
    wrong = recording.read(path, OPTIONS)
    right = recording.read(path, replace(OPTIONS, time_offset_ns=500_000_000))
    assert [np.unique(s.image.load()).tolist() for s in right.stations] == [[40], [50], [60], [70]]
    assert [s.image.load()[0, 0] for s in wrong.stations] != [40, 50, 60, 70]


@pytest.mark.parametrize(("offset", "said"), [(-5.0, "apart"), (None, "carry no stamp")])
def test_clocks_that_cannot_be_compared_give_way_to_the_recorders(tmp_path, offset, said):
    robot = Robot(stamp_offset=offset or 0.0, image_delay=0.0)

    def unstamped(messages):
        for log, topic, schema, payload in messages:
            yield log, topic, schema, payload[:4] + bytes(8) + payload[12:]

    images = robot.images() if offset else unstamped(robot.images())
    mixed = in_order(robot.static(), robot.links(), images, robot.infos())
    record = recording.read(write(tmp_path / "a.mcap", mixed), OPTIONS)
    assert [s.image.load()[0, 0] for s in record.stations] == [40, 50, 60, 70]
    finding = next(f for f in record.findings if f.code == "clock-log-time")
    assert said in finding.message


def test_pose_topic_in_place_of_tf(tmp_path):
    robot = Robot(noise=0.0)
    poses = (
        (ns(t), "/tcp", "geometry_msgs/msg/PoseStamped",
         ros2.pose(ns(t), "base", pose_numbers(robot.noisy(robot.upper, t))))
        for t in np.arange(0.0, robot.duration, 0.01)
    )  # fmt: skip
    record = recording.read(
        write(tmp_path / "a.mcap", in_order(poses, robot.images(), robot.infos())), OPTIONS
    )
    found = np.stack([station.base_T_gripper for station in record.stations])
    np.testing.assert_allclose(found, robot.upper, atol=1e-5)


@pytest.mark.parametrize("form", [".png", ".jpg"])
def test_compressed_images(tmp_path, robot, form):
    def compressed(messages):
        for log, _, _, _ in messages:
            t = (log - ns(robot.image_delay)) / 1e9
            pixels = np.full(SIZE, robot.grey(t), dtype=np.uint8)
            data = cv2.imencode(form, pixels)[1].tobytes()
            payload = ros2.compressed_image(ns(t), "camera_optical", data, "")
            schema = "sensor_msgs/msg/CompressedImage"
            yield log, "/camera/image_raw/compressed", schema, payload

    mixed = in_order(robot.static(), robot.links(), robot.infos(), compressed(robot.images()))
    record = recording.read(write(tmp_path / "a.mcap", mixed), OPTIONS)
    assert [station.image.load()[0, 0] for station in record.stations] == [40, 50, 60, 70]
    assert record.camera is not None


def test_pause_without_an_image_is_no_station_and_is_counted(tmp_path, robot, messages):
    second = (ns(PERIOD), ns(PERIOD + PAUSE))
    gap = [m for m in messages if "image" not in m[1] or not second[0] <= m[0] <= second[1]]
    record = recording.read(write(tmp_path / "a.mcap", gap), OPTIONS)
    assert [station.image.load()[0, 0] for station in record.stations] == [40, 60, 70]
    assert [station.name for station in record.stations] == ["00", "01", "02"]
    finding = next(f for f in record.findings if f.code == "pauses-without-image")
    assert "1 of 4 pauses" in finding.message


def test_bad_transforms_are_counted(tmp_path, messages):
    bad = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    payload = ros2.transforms((ns(0.5), "base_link", "link_1", bad))
    mixed = in_order(messages, [(ns(0.5), "/tf", "tf2_msgs/msg/TFMessage", payload)])
    record = recording.read(write(tmp_path / "a.mcap", mixed), OPTIONS)
    finding = next(f for f in record.findings if f.code == "transforms-dropped")
    assert finding.message.startswith("1 transforms")
    assert len(record.stations) == 4


@pytest.mark.parametrize(
    ("infos", "code"),
    [
        ([], "camera-info-missing"),
        ([(0.0,) * 9], "camera-uncalibrated"),
        ([K, (601.0, *K[1:])], "camera-info-changes"),
    ],
)
def test_doubtful_intrinsics_are_told(tmp_path, robot, infos, code):
    written = [
        (ns(i), "/camera/camera_info", "sensor_msgs/msg/CameraInfo",
         ros2.camera_info(ns(i), "camera_optical", k=k))
        for i, k in enumerate(infos)
    ]  # fmt: skip
    mixed = in_order(robot.static(), robot.links(), robot.images(), written)
    record = recording.read(write(tmp_path / "a.mcap", mixed), OPTIONS)
    assert code in codes(record)
    assert (record.camera is None) == (code != "camera-info-changes")


def test_setup_is_asked_for(path):
    with pytest.raises(InputError, match="where the camera is fixed") as caught:
        recording.read(path, McapOptions())
    assert caught.value.hint == "give --setup eye-in-hand or eye-to-hand"


def test_recording_without_images_in_pauses_is_refused(tmp_path):
    robot = Robot(stations=2)
    mixed = in_order(robot.static(), robot.links(), list(robot.images())[22:34])
    path = write(tmp_path / "a.mcap", mixed)
    with pytest.raises(InputError, match=r"found 2 pauses without one.* and 11 frames") as caught:
        recording.read(path, OPTIONS)
    assert "--moving" in caught.value.hint
    assert len(recording.read(path, replace(OPTIONS, moving=True)).stations) == 11


def test_pauses_without_images_and_few_others_are_refused(tmp_path):
    robot = Robot(stations=2)
    mixed = in_order(robot.static(), robot.links(), list(robot.images())[22:28])
    with pytest.raises(InputError, match=r"found 2 pauses without one.* fewer than 10") as caught:
        recording.read(write(tmp_path / "a.mcap", mixed), OPTIONS)
    assert "--moving" not in caught.value.hint


@pytest.mark.parametrize(
    ("numbers", "found"),
    [
        ({"k": (-600.0, *K[1:])}, "cx, cy and distortion -600"),
        ({"k": K, "model": "fisheye62"}, "'fisheye62'"),
        ({"k": K, "d": (0.1,)}, "4 or 5 coefficients of plumb_bob, found 1"),
        ({"k": K, "size": (0, 48)}, "found 0 x 48"),
    ],
)
def test_intrinsics_that_are_none_are_named_by_file_and_topic(tmp_path, robot, numbers, found):
    payload = ros2.camera_info(ns(0), "camera_optical", **numbers)
    info = (ns(0), "/camera/camera_info", "sensor_msgs/msg/CameraInfo", payload)
    mixed = in_order(robot.static(), robot.links(), robot.images(), [info])
    path = write(tmp_path / "a.mcap", mixed)
    with pytest.raises(InputError, match=found) as caught:
        recording.read(path, OPTIONS)
    assert caught.value.where == f"{path}, /camera/camera_info"
    assert caught.value.hint


def test_recording_without_images_or_without_poses_is_refused(tmp_path, robot):
    with pytest.raises(InputError, match="expected an image topic"):
        recording.read(write(tmp_path / "a.mcap", robot.static()), OPTIONS)
    with pytest.raises(InputError, match="expected a moving frame"):
        recording.read(write(tmp_path / "b.mcap", robot.images()), OPTIONS)


def test_topics_without_a_message_are_told_apart_from_those_that_cannot_be_read(tmp_path, robot):
    """A camera that was off is named in a recording all the same."""
    image = (ns(0), robot.image_topic, "sensor_msgs/msg/Image", b"")
    file = tmp_path / "a.mcap"
    write(file, in_order(robot.static(), robot.links()), silent=[image])
    found = r"/camera/image_raw \(sensor_msgs/msg/Image as cdr, without a message\)"
    with pytest.raises(InputError, match=found) as caught:
        recording.read(str(file), OPTIONS)
    assert "/tf (tf2_msgs/msg/TFMessage as cdr)" in caught.value.message
    assert caught.value.where == str(file)


def test_what_is_ambiguous_is_named_with_its_file(tmp_path, robot):
    other = replace(robot, image_topic="/right/image_raw")
    path = write(tmp_path / "a.mcap", in_order(robot.messages(), other.images()))
    with pytest.raises(InputError, match="one image topic, found 2") as caught:
        recording.read(path, OPTIONS)
    assert caught.value.where == path
    assert caught.value.hint == "choose one, as with --image-topic /camera/image_raw"


def test_images_that_are_rectified_in_a_way_nobody_tells_say_so(tmp_path):
    robot = Robot(stations=2, image_topic="/camera/image_rect")
    record = recording.read(write(tmp_path / "a.mcap", robot.messages()), OPTIONS)
    assert record.camera is None
    finding = next(f for f in record.findings if f.code == "camera-uncalibrated")
    assert "the focal length in its P is 0" in finding.message
    assert "--image-topic" in finding.advice


def test_unknown_encoding_is_named(tmp_path):
    robot = Robot(stations=2, encoding="yuv411")
    with pytest.raises(InputError, match="'yuv411'"):
        recording.read(write(tmp_path / "a.mcap", robot.messages()), OPTIONS)


def test_recordings_are_known_by_name_or_content(tmp_path, path):
    renamed = tmp_path / "robot.bin"
    renamed.write_bytes(b"\x89MCAP0\r\n...")
    other = tmp_path / "recording.yaml"
    other.write_text("schema: handeye/recording/1\n")
    assert recording.is_recording(path)
    assert recording.is_recording(str(renamed))
    assert recording.is_recording("missing.mcap")
    assert not recording.is_recording(str(other))
    assert recording.is_recording(str(tmp_path))
    assert not recording.is_recording("missing.yaml")
    assert not recording.is_recording("-")


def test_a_pipe_is_not_looked_into(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert not recording.is_recording(str(pipe))  # nor waited for


def test_asking_what_a_file_is_loads_nothing_heavy():
    program = (
        "import sys; from handeye_cli import recording; recording.is_recording('x.yaml');"
        "print([m for m in ('mcap', 'mcap_ros2', 'cv2', 'scipy') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"
