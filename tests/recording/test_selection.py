"""What is unique is found; what is ambiguous or missing is listed."""

import numpy as np
import pytest
from recording import ros2
from recording.bags import K, ns, random_pose, write
from recording.bags import pose_numbers as numbers_of

from handeye_cli.errors import InputError, UsageError
from handeye_cli.recording import selection, survey
from handeye_cli.recording.options import McapOptions

STILL = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
PIXELS = np.zeros((4, 6), dtype=np.uint8)


def image(topic, encoding="mono8", frame="cam"):
    return ns(0), topic, "sensor_msgs/msg/Image", ros2.image(ns(0), frame, PIXELS, encoding)


def info(topic, frame="cam"):
    return ns(0), topic, "sensor_msgs/msg/CameraInfo", ros2.camera_info(ns(0), frame, k=K)


def tf(parent, child, *, moves=True, topic="/tf", seed=1):
    rng = np.random.default_rng(seed)
    for t in range(3):
        numbers = numbers_of(random_pose(rng)) if moves else STILL
        payload = ros2.transforms((ns(t), parent, child, numbers))
        yield ns(t), topic, "tf2_msgs/msg/TFMessage", payload


def static(parent, child):
    return next(tf(parent, child, moves=False, topic="/robot/tf_static"))


def pose(topic, frame="base"):
    return ns(0), topic, "geometry_msgs/msg/PoseStamped", ros2.pose(ns(0), frame, STILL)


@pytest.fixture
def survey_of(tmp_path):
    def make(*messages, **options):
        return survey.take(write(tmp_path / "a.mcap", messages, **options))

    return make


ARM = [*tf("base", "arm"), *tf("arm", "wrist"), static("world", "base"), static("wrist", "cam")]


def test_only_picture_is_found_beside_depth(survey_of):
    content = survey_of(image("/depth/image", "16UC1"), image("/color/image_raw", "rgb8"))
    assert selection.images(content, None).topic == "/color/image_raw"


def test_several_image_topics_are_listed(survey_of):
    content = survey_of(image("/right/image_raw"), image("/left/image_raw"))
    with pytest.raises(InputError, match="found 2: /left/image_raw, /right/image_raw") as caught:
        selection.images(content, None)
    assert "--image-topic" in caught.value.hint
    assert selection.images(content, "/right/image_raw").topic == "/right/image_raw"


def test_mistyped_topic_is_named_with_the_nearest(survey_of):
    content = survey_of(image("/left/image_raw"))
    with pytest.raises(InputError, match="found '/left/image'") as caught:
        selection.images(content, "/left/image")
    assert caught.value.where == "--image-topic"
    assert "/left/image_raw" in caught.value.hint


@pytest.mark.parametrize("wanted", [None, "/depth/image"])
def test_depth_alone_is_refused_by_its_encoding(survey_of, wanted):
    content = survey_of(image("/depth/image", "32FC1"))
    with pytest.raises(InputError, match="'32FC1'") as caught:
        selection.images(content, wanted)
    assert "/depth/image" in caught.value.where


def test_no_image_topic_lists_what_there_is(survey_of):
    content = survey_of(*ARM, (ns(0), "/cloud", "foxglove.PointCloud", b""))
    with pytest.raises(InputError, match=r"/cloud \(foxglove.PointCloud as cdr\)"):
        selection.images(content, None)


def test_channels_in_other_encodings_are_listed_not_read(survey_of):
    other = {"/image": ("json", "jsonschema", "{}"), "/tf": ("wrong_format", "ros2msg", "")}
    content = survey_of(*ARM, image("/image"), schemas=other)
    with pytest.raises(InputError, match=r"/image \(sensor_msgs/msg/Image as json\)"):
        selection.images(content, None)


@pytest.mark.parametrize("wanted", [None, "/video"])
def test_video_is_named_with_what_to_record(survey_of, wanted):
    content = survey_of(*ARM, (ns(0), "/video", "foxglove.CompressedVideo", b""))
    with pytest.raises(InputError, match=r"found video: /video \(foxglove.Comp") as caught:
        selection.images(content, wanted)
    assert "single frames" in caught.value.hint


def test_video_beside_images_is_in_nobodys_way(survey_of):
    video = (ns(0), "/video", "foxglove_msgs/msg/CompressedVideo", b"")
    content = survey_of(image("/left/image_raw"), video)
    assert selection.images(content, None).topic == "/left/image_raw"
    with pytest.raises(InputError, match="found video"):
        selection.images(content, "/video")
    with pytest.raises(InputError, match="found '/left/imag_raw'"):
        selection.images(content, "/left/imag_raw")


@pytest.mark.parametrize("topic", ["/depth/image", "/camera/aligned_depth_to_color/image_raw"])
def test_sixteen_bits_are_depths_by_the_name_of_the_topic(survey_of, topic):
    content = survey_of(image(topic, "16UC1"), image("/infra/image", "16UC1"))
    assert selection.images(content, None).topic == "/infra/image"
    with pytest.raises(InputError, match="'16UC1', which holds depths"):
        selection.images(content, topic)


def test_file_without_messages_says_so(survey_of):
    with pytest.raises(InputError, match="found no channels at all"):
        selection.images(survey_of(), None)


@pytest.mark.parametrize("place", ["/left", "/camera/camera/color"])
@pytest.mark.parametrize("name", ["image_raw", "image_raw/compressed", "image_rect_color"])
def test_intrinsics_are_those_beside_the_images(survey_of, place, name):
    beside, other = f"{place}/camera_info", f"{place}/depth/camera_info"
    content = survey_of(image(f"{place}/{name}"), info(beside), info(other))
    frames = selection.images(content, None)
    assert selection.camera_info_topic(content, frames, None) == beside
    assert selection.camera_info_topic(content, frames, other) == other


def test_intrinsics_elsewhere_are_known_by_their_frame(survey_of):
    content = survey_of(image("/pictures", frame="/b"), info("/x/info", "a"), info("/y/info", "b"))
    frames = selection.images(content, None)
    assert selection.camera_info_topic(content, frames, None) == "/y/info"


def test_only_intrinsics_belong_to_the_only_images(survey_of):
    content = survey_of(image("/pictures", frame=""), info("/x/info", "a"))
    assert selection.camera_info_topic(content, selection.images(content, None), None) == "/x/info"
    several = survey_of(image("/pictures", frame=""), image("/other"), info("/x/info", "a"))
    frames = selection.images(several, "/pictures")
    assert selection.camera_info_topic(several, frames, None) is None


def test_several_intrinsics_are_listed(survey_of):
    content = survey_of(image("/pictures"), info("/x/info"), info("/y/info"))
    frames = selection.images(content, None)
    with pytest.raises(InputError, match="/x/info, /y/info") as caught:
        selection.camera_info_topic(content, frames, None)
    assert "--camera-info-topic" in caught.value.hint


def chain_of(content, camera="cam", **options):
    chain = selection.robot_chain(content, camera, McapOptions(**options))
    return chain.base, chain.gripper


def test_only_chain_leads_from_the_root_to_the_last_moving_frame(survey_of):
    assert chain_of(survey_of(*ARM)) == ("world", "wrist")


def test_frames_asked_for_go_before(survey_of):
    content = survey_of(*ARM)
    assert chain_of(content, base_frame="base") == ("base", "wrist")
    assert chain_of(content, gripper_frame="/cam") == ("world", "cam")
    assert chain_of(content, base_frame="arm", gripper_frame="cam") == ("arm", "cam")


def test_markers_seen_by_the_camera_are_no_robot(survey_of):
    markers = [*tf("cam", "tag_0"), *tf("cam", "tag_1", seed=2)]
    assert chain_of(survey_of(*ARM, *markers)) == ("world", "wrist")
    with pytest.raises(InputError, match="tag_0, tag_1"):
        chain_of(survey_of(*ARM, *markers), camera="")


def test_fingers_that_do_not_move_are_passed_over(survey_of):
    fingers = [*tf("hand", "left", moves=False), *tf("hand", "right", moves=False)]
    content = survey_of(*ARM, static("wrist", "hand"), *fingers)
    assert chain_of(content) == ("world", "wrist")


def test_two_arms_are_listed(survey_of):
    content = survey_of(*ARM, *tf("world", "other", seed=3), *tf("other", "other_wrist", seed=4))
    with pytest.raises(InputError, match="found 2: other_wrist, wrist") as caught:
        chain_of(content)
    assert "--gripper-frame" in caught.value.hint
    assert chain_of(content, base_frame="base") == ("base", "wrist")


@pytest.mark.parametrize("first", [True, False])
def test_a_base_that_is_named_says_which_of_two_parents_counts(survey_of, first):
    """A tracker tells of the wrist, too."""
    tracked = tf("tracker", "wrist", seed=5)
    content = survey_of(*tracked, *ARM) if first else survey_of(*ARM, *tracked)
    with pytest.raises(InputError, match="one parent of the frame 'wrist'"):
        chain_of(content)
    assert chain_of(content, base_frame="base") == ("base", "wrist")


def test_unknown_frame_is_named(survey_of):
    with pytest.raises(InputError, match="found 'tool0'"):
        chain_of(survey_of(*ARM), gripper_frame="tool0")


def test_gripper_fixed_to_the_base_is_refused(survey_of):
    with pytest.raises(InputError, match="found 'cam' fixed to 'wrist'"):
        chain_of(survey_of(*ARM), base_frame="wrist", gripper_frame="cam")


def test_base_with_nothing_moving_below_lists_the_frames(survey_of):
    with pytest.raises(InputError, match="moves below 'cam', found none") as caught:
        chain_of(survey_of(*ARM), camera="", base_frame="cam")
    assert "arm, base, cam, world, wrist" in caught.value.hint


def test_static_transforms_alone_are_not_enough(survey_of):
    with pytest.raises(InputError, match="expected a moving frame in /tf") as caught:
        chain_of(survey_of(static("base", "wrist"), image("/image")))
    assert "PoseStamped" in caught.value.hint


def test_only_pose_topic_is_used_where_no_frame_moves(survey_of):
    assert chain_of(survey_of(static("base", "x"), pose("/tcp"))) == ("base", "/tcp")


def test_frames_that_move_go_before_a_pose_topic_not_asked_for(survey_of):
    content = survey_of(*ARM, pose("/goal"), pose("/tcp"))
    assert chain_of(content) == ("world", "wrist")
    assert chain_of(content, pose_topic="/tcp") == ("base", "/tcp")


def test_several_pose_topics_are_listed(survey_of):
    with pytest.raises(InputError, match="/goal, /tcp") as caught:
        chain_of(survey_of(pose("/goal"), pose("/tcp")))
    assert "--pose-topic" in caught.value.hint


def test_poses_in_two_frames_are_refused_where_they_are_used(survey_of):
    content = survey_of(*ARM, pose("/tcp", "base"), pose("/tcp", "map"))
    assert chain_of(content) == ("world", "wrist")
    with pytest.raises(InputError, match="'/tcp' in 'base', '/tcp' in 'map'"):
        chain_of(content, pose_topic="/tcp")


@pytest.mark.parametrize("schema", ["foxglove.PosesInFrame", "geometry_msgs/msg/PoseArray"])
@pytest.mark.parametrize("wanted", [None, "/poses"])
def test_several_poses_in_a_message_are_named_with_what_to_record(survey_of, schema, wanted):
    content = survey_of(static("base", "wrist"), (ns(0), "/poses", schema, b""))
    with pytest.raises(InputError, match="found several poses in a message: /poses") as caught:
        chain_of(content, pose_topic=wanted)
    assert "record the gripper's own pose" in caught.value.hint


def test_several_poses_in_a_message_are_in_nobodys_way(survey_of):
    poses = (ns(0), "/poses", "foxglove.PosesInFrame", b"")
    assert chain_of(survey_of(*ARM, poses)) == ("world", "wrist")
    assert chain_of(survey_of(pose("/tcp"), poses)) == ("base", "/tcp")


def test_joint_angles_alone_need_the_robots_description(survey_of):
    payload = ros2.joint_state(ns(0), {"elbow": 0.1})
    joints = (ns(0), "/joint_states", "sensor_msgs/msg/JointState", payload)
    with pytest.raises(InputError, match=r"expected a moving frame .* /joint_states") as caught:
        chain_of(survey_of(joints))
    assert "/robot_description" in caught.value.hint


def test_odometry_names_the_frame_it_is_of(survey_of):
    payload = ros2.odometry(ns(0), "/odom", "flange", STILL)
    odometry = (ns(0), "/robot/odom", "nav_msgs/msg/Odometry", payload)
    assert chain_of(survey_of(odometry)) == ("odom", "flange")
    assert chain_of(survey_of(*ARM, odometry), pose_topic="/robot/odom") == ("odom", "flange")
    other = (ns(1), "/robot/odom", "nav_msgs/msg/Odometry", ros2.odometry(ns(1), "odom", "", STILL))
    with pytest.raises(InputError, match="'flange' in 'odom', '/robot/odom' in 'odom'"):
        chain_of(survey_of(odometry, other))


def test_single_transforms_are_links_of_the_tree(survey_of):
    rng = np.random.default_rng(1)
    links = [
        (ns(t), topic, "geometry_msgs/msg/TransformStamped",
         ros2.transform(ns(t), parent, child, numbers_of(random_pose(rng))))
        for t in range(3)
        for topic, parent, child in (("/arm", "base", "arm"), ("/wrist", "arm", "wrist"))
    ]  # fmt: skip
    assert chain_of(survey_of(*links)) == ("base", "wrist")


def test_foxglove_transform_that_is_sent_once_holds_for_all_time(survey_of):
    def sent(t, parent, child, numbers):
        payload = ros2.frame_transform(ns(t), parent, child, numbers)
        return ns(t), "/tf", "foxglove_msgs/msg/FrameTransform", payload

    rng = np.random.default_rng(1)
    moving = [sent(t, "base", "wrist", numbers_of(random_pose(rng))) for t in range(3)]
    content = survey_of(sent(0, "world", "base", STILL), *moving)
    assert {(link.child, link.static) for link in content.links} == {
        ("base", True), ("wrist", False),
    }  # fmt: skip
    assert chain_of(content) == ("world", "wrist")


def test_pose_topic_that_is_not_there_is_named(survey_of):
    with pytest.raises(InputError, match="expected a topic with stamped poses"):
        chain_of(survey_of(*ARM), pose_topic="/tcp")


@pytest.mark.parametrize("frame", ["base_frame", "gripper_frame"])
def test_pose_topic_and_frames_exclude_each_other(survey_of, frame):
    with pytest.raises(UsageError, match="--pose-topic or frames"):
        chain_of(survey_of(*ARM, pose("/tcp")), pose_topic="/tcp", **{frame: "base"})
