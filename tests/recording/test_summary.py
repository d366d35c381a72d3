"""A look into a recording tells what it holds, also where reading it would stop."""

import numpy as np
import pytest
from mcap.writer import CompressionType
from recording import ros2
from recording.bags import PAUSE, PERIOD, K, Robot, in_order, ns, write
from recording.surgery import flipped

from handeye_cli import recording
from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError, UsageError
from handeye_cli.recording import McapOptions
from handeye_cli.records import Camera, TargetSpec
from handeye_cli.records.recording_summary import MissingFlag, Motion

BOTH = McapOptions(setup=Setup.EYE_IN_HAND, target=TargetSpec("chessboard"))
PIXELS = np.zeros((4, 6), dtype=np.uint8)


@pytest.fixture(scope="module")
def robot():
    return Robot()


@pytest.fixture(scope="module")
def messages(robot):
    return robot.messages()


@pytest.fixture
def look(tmp_path):
    def make(messages, options=BOTH, flags=None, **layout):
        path = write(tmp_path / "a.mcap", messages, **layout)
        return recording.look(path, options, flags or {}).inspection

    return make


def errors(inspection):
    return [finding.code for finding in inspection.errors]


def test_a_recording_that_leaves_nothing_open(look, robot, messages, tmp_path):
    inspection = look(messages, BOTH, {"setup": "eye-in-hand", "target": "chessboard:9x6:2mm"})
    summary = inspection.recording
    assert errors(inspection) == []
    assert summary.ready
    assert summary.missing == ()
    used = summary.used
    assert used.image_topic == "/camera/image_raw"
    assert used.camera_info_topic == "/camera/camera_info"
    assert used.camera == Camera(64, 48, K[0], K[4], K[2], K[5], (0.1, -0.2, 0.0, 0.0, 0.0))
    assert used.frames == ("world", "base_link", "link_1", "wrist")
    assert used.pose_topic is None
    assert used.clock == "header.stamp"
    assert summary.command == (
        f"handeye solve {tmp_path}/a.mcap --setup eye-in-hand --target chessboard:9x6:2mm"
    )


def test_it_tells_the_findings_that_reading_tells(look, messages, tmp_path):
    inspection = look(messages)
    read = recording.read(str(tmp_path / "a.mcap"), BOTH)
    told = {finding.code for finding in read.findings} - {"recording-choices"}
    assert {finding.code for finding in inspection.diagnosis} == told


def test_topics_are_counted_whether_they_can_be_read_or_not(look, robot, messages):
    strange = [(ns(t), "/lidar", "acme_msgs/msg/Cloud", b"\0\1\0\0") for t in range(5)]
    summary = look(in_order(messages, strange)).recording
    topics = {topic.name: topic for topic in summary.topics}
    assert list(topics) == sorted(topics)
    counts = {name: topic.count for name, topic in topics.items()}
    assert counts == {
        "/camera/camera_info": len(list(robot.infos())),
        "/camera/image_raw": len(list(robot.images())),
        "/lidar": 5,
        "/tf": len(list(robot.links())),
        "/tf_static": 1,
    }
    assert topics["/lidar"].rate == pytest.approx(1.0)
    assert topics["/camera/image_raw"].rate == pytest.approx(robot.image_rate, rel=1e-6)
    assert topics["/tf_static"].rate is None
    assert [topics[name].role for name in ("/lidar", "/tf", "/camera/image_raw")] == [
        "",
        "transforms",
        "image",
    ]
    assert topics["/lidar"].schema == "acme_msgs/msg/Cloud"


def test_frames_and_what_they_do(look, robot, messages):
    still = [
        (
            ns(t),
            "/tf",
            "tf2_msgs/msg/TFMessage",
            ros2.transforms((ns(t), "wrist", "finger", (0.1, 0, 0, 0, 0, 0, 1))),
        )
        for t in range(3)
    ]
    summary = look(in_order(messages, still)).recording
    assert {(link.parent, link.child): link.motion for link in summary.links} == {
        ("world", "base_link"): Motion.STATIC,
        ("base_link", "link_1"): Motion.MOVING,
        ("link_1", "wrist"): Motion.MOVING,
        ("wrist", "camera_optical"): Motion.STATIC,
        ("wrist", "finger"): Motion.STILL,
    }
    counts = {link.child: link.count for link in summary.links}
    assert counts["finger"] == 3
    assert counts["wrist"] == len(list(robot.links())) / 2


def test_pauses_have_their_times_and_images(look, robot, messages):
    pauses = look(messages).recording.pauses
    assert len(pauses) == robot.stations
    for index, pause in enumerate(pauses):
        # what lies within the window of the speed beside a motion counts as motion
        assert index * PERIOD - 0.05 <= pause.start <= index * PERIOD + 0.3
        assert PAUSE - 0.5 <= pause.duration <= PAUSE + 0.05
        assert pause.images == pytest.approx(pause.duration * robot.image_rate, abs=2)


def test_nothing_is_said_but_the_file(look, messages, tmp_path):
    inspection = look(messages, McapOptions())
    summary = inspection.recording
    assert inspection.setup is None
    assert inspection.stations == ()
    assert errors(inspection) == []
    assert not summary.ready
    assert summary.missing == (
        MissingFlag("--setup", ("eye-in-hand", "eye-to-hand")),
        MissingFlag("--target"),
    )
    assert summary.command == f"handeye solve {tmp_path}/a.mcap --setup WHERE --target SPEC"


def test_several_image_topics_are_choices_and_the_rest_goes_on(look, robot, messages):
    other = [
        (ns(1), "/right/image_raw", "sensor_msgs/msg/Image", ros2.image(ns(1), "right", PIXELS))
    ]
    inspection = look(in_order(messages, other), BOTH, {"setup": "eye-in-hand"})
    assert errors(inspection) == ["ambiguous-image-topic"]
    assert "/camera/image_raw, /right/image_raw" in inspection.errors[0].message
    summary = inspection.recording
    assert not summary.ready
    choices = ("/camera/image_raw", "/right/image_raw")
    assert summary.missing == (MissingFlag("--image-topic", choices),)
    assert summary.command.endswith("a.mcap --setup eye-in-hand --image-topic TOPIC")
    assert summary.used.image_topic is None
    assert summary.used.frames[-1] == "wrist"


def test_every_ambiguity_is_told_at_once(look, robot):
    streams = [robot.static(), robot.images(), robot.infos()]
    rng = np.random.default_rng(5)
    for side in ("left", "right"):
        streams.append(
            [
                (
                    ns(t),
                    "/tf",
                    "tf2_msgs/msg/TFMessage",
                    ros2.transforms((ns(t), "base", side, (*rng.normal(size=3), 0, 0, 0, 1))),
                )
                for t in range(3)
            ]
        )
    streams.append([(ns(0), "/other/image", "sensor_msgs/msg/Image", next(robot.images())[3])])
    inspection = look(in_order(*streams))
    assert errors(inspection) == ["ambiguous-image-topic", "ambiguous-gripper-frame"]
    missing = {each.flag: each.choices for each in inspection.recording.missing}
    assert missing["--gripper-frame"] == ("left", "right")
    assert "--gripper-frame FRAME" in inspection.recording.command


@pytest.mark.parametrize(
    ("streams", "code", "word"),
    [
        (["static", "links"], "no-images", "expected an image topic"),
        (["static", "images"], "no-robot-poses", "expected a moving frame in /tf"),
    ],
)
def test_what_is_missing_is_an_error_with_the_next_step(look, robot, streams, code, word):
    inspection = look(in_order(*(getattr(robot, name)() for name in streams)))
    assert errors(inspection) == [code]
    assert word in inspection.errors[0].message
    assert inspection.errors[0].advice
    assert inspection.recording.pauses == ()


def test_a_robot_that_never_stands_still(look, robot):
    moving = Robot(stations=2)
    moving.moving = lambda _t: True
    links = [message for message in moving.links() if PAUSE < (message[0] - ns(0)) / 1e9 < PERIOD]
    images = list(robot.images())
    inspection = look(in_order(robot.static(), links, images[:25]))
    assert errors(inspection) == ["no-stations"]
    assert "no pause" in inspection.errors[0].message
    inspection = look(in_order(robot.static(), links, images))
    assert errors(inspection) == []
    assert [finding.code for finding in inspection.diagnosis][-1] == "stations-moving"
    assert inspection.recording.ready


def test_poses_of_a_topic(look, robot):
    poses = [
        (
            ns(t),
            "/arm/pose",
            "geometry_msgs/msg/PoseStamped",
            ros2.pose(ns(t), "base", (0.1 * t, 0, 0, 0, 0, 0, 1)),
        )
        for t in range(3)
    ]
    used = look(in_order(poses, robot.images())).recording.used
    assert used.pose_topic == "/arm/pose"
    assert used.frames[0] == "base"


def test_a_frame_that_is_not_there_is_an_error(look, messages):
    inspection = look(messages, McapOptions(base_frame="bse_link"))
    assert errors(inspection) == ["no-robot-poses"]
    assert "'bse_link'" in inspection.errors[0].message
    assert "base_link" in inspection.errors[0].advice


def test_a_recording_that_was_cut_off(look, messages, tmp_path):
    look(messages)
    whole = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "b.mcap").write_bytes(whole[: len(whole) // 2])
    inspection = recording.look(str(tmp_path / "b.mcap"), BOTH, {}).inspection
    assert inspection.recording.cut
    assert "recording-cut" in {finding.code for finding in inspection.diagnosis}
    assert 0 < inspection.recording.duration < 6


@pytest.mark.parametrize(("topic", "severity"), [("/tf", "warning"), ("/cloud", "info")])
def test_damage_is_a_warning_only_where_it_may_touch_the_answer(
    messages, tmp_path, topic, severity
):
    """Solving does not even look at the rest; who looks at all of it hears of that as well."""
    cloud = (ns(1.5), "/cloud", "sensor_msgs/msg/PointCloud2", b"a cloud of points")
    every = in_order(messages, [cloud])
    path = write(tmp_path / "a.mcap", every, chunk_size=1, compression=CompressionType.NONE)
    raw = (tmp_path / "a.mcap").read_bytes()
    damaged = next(payload for _, of, _, payload in every[len(every) // 2 :] if of == "/tf")
    at = raw.index(cloud[3] if topic == "/cloud" else damaged)
    (tmp_path / "a.mcap").write_bytes(flipped(raw, at))
    looked = recording.look(path, BOTH, {})
    (told,) = [each for each in looked.inspection.diagnosis if each.code == "recording-damaged"]
    assert told.severity == severity
    assert "a.mcap, byte " in told.message
    assert told in looked.recording.findings
    read = recording.read(path, BOTH)
    assert ("recording-damaged" in {each.code for each in read.findings}) == (topic == "/tf")
    assert len(read.stations) == len(looked.recording.stations) == 4


def test_options_that_contradict_each_other_and_files_that_are_none(look, messages, tmp_path):
    with pytest.raises(UsageError, match="--pose-topic"):
        look(messages, McapOptions(pose_topic="/pose", base_frame="base_link"))
    (tmp_path / "no.mcap").write_bytes(b"nothing of the kind")
    with pytest.raises(InputError, match="found a file that starts with b'nothing "):
        recording.look(str(tmp_path / "no.mcap"), BOTH, {})


def test_intrinsics_of_a_file_of_their_own_are_named(look, messages):
    options = McapOptions(own_intrinsics=True)
    summary = look(messages, options, {"camera": "my camera.yaml"}).recording
    assert summary.used.camera is None
    assert summary.used.camera_file == "my camera.yaml"
    assert "--camera 'my camera.yaml'" in summary.command
