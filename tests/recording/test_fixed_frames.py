"""The pose of an optical frame in its mount link, out of TF."""

import numpy as np
import pytest
from recording import bags, ros2
from scipy.spatial.transform import Rotation

from handeye_cli.errors import InputError
from handeye_cli.geometry import se3
from handeye_cli.recording import fixed_frames

FLAGS = ("--mount-frame", "--child")
STILL, MOVING = "/tf_static", "/tf"
RNG = np.random.default_rng(6)
LINK_T_COLOR, COLOR_T_OPTICAL, LINK_T_DEPTH = (bags.random_pose(RNG) for _ in range(3))


def write(tmp_path, *links):
    """Write (topic, seconds, parent, child, pose) of links; return the file's path."""
    messages = [
        (bags.ns(t), topic, "tf2_msgs/msg/TFMessage",
         ros2.transforms((bags.ns(t), parent, child, bags.pose_numbers(T))))
        for topic, t, parent, child, T in links
    ]  # fmt: skip
    return bags.write(tmp_path / "tf.mcap", messages)


def camera_links(topic=STILL, times=(0.0,)):
    for t in times:
        yield topic, t, "camera_link", "camera_color_frame", LINK_T_COLOR
        yield topic, t, "camera_color_frame", "camera_color_optical_frame", COLOR_T_OPTICAL
        yield topic, t, "camera_link", "camera_depth_frame", LINK_T_DEPTH


@pytest.mark.parametrize(
    ("topic", "times"),
    [(STILL, (0.0,)), (MOVING, (0.0, 0.1, 0.2)), ("/rig/tf_static", (0.0,))],
    ids=["static", "published again and again", "in a namespace"],
)
def test_links_are_chained(tmp_path, topic, times):
    path = write(tmp_path, *camera_links(topic, times))
    found = fixed_frames.read(path, "/camera_link", "camera_color_optical_frame", FLAGS)
    np.testing.assert_allclose(found, LINK_T_COLOR @ COLOR_T_OPTICAL, atol=1e-14)
    across = fixed_frames.read(path, "camera_depth_frame", "camera_color_frame", FLAGS)
    np.testing.assert_allclose(across, np.linalg.inv(LINK_T_DEPTH) @ LINK_T_COLOR, atol=1e-14)


def test_a_link_elsewhere_may_move(tmp_path):
    arm = [(MOVING, t, "base", "camera_link", bags.random_pose(RNG)) for t in (0.0, 0.1)]
    path = write(tmp_path, *camera_links(), *arm)
    found = fixed_frames.read(path, "camera_link", "camera_color_frame", FLAGS)
    np.testing.assert_allclose(found, LINK_T_COLOR, atol=1e-14)


def test_a_link_that_moves_is_named(tmp_path):
    turned = se3.from_parts(Rotation.from_rotvec([0.01, 0, 0]).as_matrix(), np.zeros(3))
    tilting = [
        (MOVING, 0.0, "base", "camera_link", np.eye(4)),
        (MOVING, 1.0, "base", "camera_link", turned),
    ]
    path = write(tmp_path, *camera_links(), *tilting)
    with pytest.raises(InputError, match="found that 'camera_link' in 'base' moves"):
        fixed_frames.read(path, "base", "camera_color_optical_frame", FLAGS)


def test_frames_that_are_not_there(tmp_path):
    path = write(tmp_path, *camera_links())
    with pytest.raises(InputError, match=r"--mount-frame: .* found 'camera_lnk'; .*camera_link"):
        fixed_frames.read(path, "camera_lnk", "camera_color_frame", FLAGS)
    with pytest.raises(InputError, match=r"--child: .* found 'optical'"):
        fixed_frames.read(path, "camera_link", "optical", FLAGS)


def test_frames_of_two_trees(tmp_path):
    path = write(tmp_path, *camera_links(), (STILL, 0.0, "base", "tool", np.eye(4)))
    with pytest.raises(InputError, match="their roots 'base' and 'camera_link'") as caught:
        fixed_frames.read(path, "tool", "camera_link", FLAGS)
    assert "--mount-frame and --child" in caught.value.hint
