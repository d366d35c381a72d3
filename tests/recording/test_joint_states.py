"""A robot's poses from its joints: against kinematics by hand, and in whole recordings."""

import numpy as np
import pytest
from recording import ros2
from recording.bags import MOVE, PAUSE, PERIOD, Robot, in_order, ns, write
from scipy.spatial.transform import Rotation

from handeye_cli import recording
from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError
from handeye_cli.geometry import se3
from handeye_cli.recording import McapOptions, joint_states, survey, urdf
from handeye_cli.recording.clock import Clock
from handeye_cli.recording.messages import Header, JointsMessage
from handeye_cli.recording.transforms import TransformTree

OPTIONS = McapOptions(setup=Setup.EYE_IN_HAND)

# A six-joint arm with every kind of joint: x y z, roll pitch yaw, axis.
ARM = [
    ("shoulder", "revolute", (0, 0, 0.33), (0, 0, 0), (0, 0, 1)),
    ("lift", "revolute", (0.05, 0, 0), (-1.2, 0.1, 0), (0, 0, 2)),
    ("elbow", "revolute", (0.44, 0.01, 0), (0, 0, 0.7), (0, -1, 0)),
    ("slide", "prismatic", (0, 0.02, 0.1), (0.3, 0.2, 0.1), (1, 1, 0)),
    ("roll", "continuous", (0.1, 0, 0.42), (0, 1.4, 0), (0.6, 0, 0.8)),
    ("wrist", "revolute", (0, 0, 0.08), (3.0, 0, -2.0), (1, 0, 0)),
]
HERE = ((0, 0, 0), (0, 0, 0))
FLANGE = ((0.0, 0.01, 0.05), (0.1, -0.2, 0.3))


def words(numbers):
    return " ".join(map(str, numbers))


def joint_xml(name, kind, links, origin, inner=""):
    (parent, child), (xyz, rpy) = links, origin
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{words(xyz)}" rpy="{words(rpy)}"/>{inner}</joint>'
    )


def description(extra=""):
    """The arm from `base` over `link_1` to `link_6`, and a flange fixed to that."""
    parts = [
        joint_xml(
            name, kind, (f"link_{i}" if i else "base", f"link_{i + 1}"), (xyz, rpy),
            f'<axis xyz="{words(axis)}"/>',
        )
        for i, (name, kind, xyz, rpy, axis) in enumerate(ARM)
    ]  # fmt: skip
    parts.append(joint_xml("flange_joint", "fixed", ("link_6", "flange"), FLANGE))
    other = '<transmission name="t"><joint name="shoulder"/></transmission>'
    return f'<?xml version="1.0"?><robot name="arm">{other}{"".join(parts)}{extra}</robot>'


def by_hand(values):
    """base_T_link_6 at the six values, with SciPy and from the definition of URDF."""
    T = np.eye(4)
    for (_, kind, xyz, rpy, axis), value in zip(ARM, values, strict=True):
        unit = np.array(axis) / np.linalg.norm(axis)
        origin, motion = np.eye(4), np.eye(4)
        origin[:3, :3], origin[:3, 3] = Rotation.from_euler("xyz", rpy).as_matrix(), xyz
        if kind == "prismatic":
            motion[:3, 3] = value * unit
        else:
            motion[:3, :3] = Rotation.from_rotvec(value * unit).as_matrix()
        T = T @ origin @ motion
    return T


def record_of(rows):
    """The record of (n, 6) values, one row a second."""
    record = joint_states.JointRecord()
    names = [name for name, *_ in ARM]
    for t, row in enumerate(rows):
        message = JointsMessage(Header(ns(t), ""), tuple(zip(names, row, strict=True)))
        record.add(ns(t), message)
    return record


def poses_of(links, base, gripper, times):
    poses, known = TransformTree(links).chain(base, gripper).at(times, Clock.STAMP)
    assert known.all()
    return poses


def test_arm_is_where_kinematics_by_hand_have_it():
    rows = np.random.default_rng(3).uniform(-3.0, 3.0, (20, 6))
    joints = urdf.parse(description(), "/robot_description")
    links, computed = joint_states.with_joints((), joints, record_of(rows))
    assert computed == 7
    times = np.array([ns(t) for t in range(len(rows))])
    expected = np.array([by_hand(row) for row in rows])
    np.testing.assert_allclose(poses_of(links, "base", "link_6", times), expected, atol=1e-12)
    flange = np.eye(4)
    flange[:3, :3] = Rotation.from_euler("xyz", FLANGE[1]).as_matrix()
    flange[:3, 3] = FLANGE[0]
    found = poses_of(links, "base", "flange", times)
    np.testing.assert_allclose(found, expected @ flange, atol=1e-12)


def test_between_two_states_the_joints_move_evenly():
    rows = np.array([np.zeros(6), [0.2, -0.3, 0.4, 0.1, 0.5, -0.6]])
    joints = urdf.parse(description(), "/robot_description")
    links, _ = joint_states.with_joints((), joints, record_of(rows))
    found = poses_of(links, "base", "link_6", np.array([ns(0.25)]))
    np.testing.assert_allclose(found[0], by_hand(0.25 * rows[1]), atol=1e-12)


def finger(name, child, mimic=""):
    return joint_xml(name, "prismatic", ("link_6", child), HERE, mimic)


def test_mimic_follows_its_leader_and_that_ones_leader():
    extra = finger("left", "left_finger", '<mimic joint="slide" multiplier="-2" offset="0.5"/>')
    extra += finger("right", "right_finger", '<mimic joint="left" multiplier="3"/>')
    joints = urdf.parse(description(extra), "/robot_description")
    rows = np.zeros((2, 6))
    rows[:, 3] = 0.1, 0.2
    links, _ = joint_states.with_joints((), joints, record_of(rows))
    times = np.array([ns(0), ns(1)])
    # without an axis it slides along x
    left = poses_of(links, "link_6", "left_finger", times)[:, 0, 3]
    np.testing.assert_allclose(left, [0.5 - 0.2, 0.5 - 0.4], atol=1e-14)
    right = poses_of(links, "link_6", "right_finger", times)[:, 0, 3]
    np.testing.assert_allclose(right, 3 * left, atol=1e-14)


def test_joints_that_mimic_each_other_end():
    extra = finger("left", "l", '<mimic joint="right"/>')
    extra += finger("right", "r", '<mimic joint="left"/>')
    joints = urdf.parse(description(extra), "/robot_description")
    _, computed = joint_states.with_joints((), joints, record_of(np.zeros((2, 6))))
    assert computed == 7


def test_values_that_are_no_numbers_and_joints_without_any_are_left_out():
    rows = np.zeros((3, 6))
    rows[1, 0] = np.nan
    joints = urdf.parse(description(finger("left", "left_finger")), "/robot_description")
    links, computed = joint_states.with_joints((), joints, record_of(rows))
    assert computed == 7
    counts = {link.child: len(link.numbers) for link in links}
    assert (counts["link_1"], counts["link_2"]) == (2, 3)
    assert "left_finger" not in counts


HOSTILE = '<!DOCTYPE r [<!ENTITY a "haha"><!ENTITY b "&a;&a;">]><robot name="&b;"/>'


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("<robot>", "not valid XML"),
        ("<sdf/>", "expected a description with <robot>, found <sdf>"),
        (HOSTILE, "expected XML without a document type"),
        (description().replace("continuous", "rotary"), "found 'rotary'"),
        (description().replace('<parent link="link_2"/>', ""), "expected a parent link"),
        (description().replace('xyz="0 0 1"', 'xyz="0 0 0"'), "an axis with a direction"),
        (description().replace('xyz="0 0 0.33"', 'xyz="0 0"'), "3 finite numbers as xyz"),
        (description().replace('rpy="0 0 0.7"', 'rpy="0 0 inf"'), "found '0 0 inf'"),
        (description().replace('xyz="0 0 0.33"', 'xyz="${a} 0 0"'), "found '${a} 0 0'"),
        (
            description(finger("f", "g", '<mimic joint="slide" multiplier="two"/>')),
            "a finite number as multiplier, found 'two'",
        ),
    ],
)
def test_bad_descriptions_are_refused(text, expected):
    with pytest.raises(InputError) as caught:
        urdf.parse(text, "/robot_description")
    assert expected in caught.value.message
    assert "/robot_description" in caught.value.where


def test_joints_of_more_than_one_number_are_passed_over():
    extra = joint_xml("free", "floating", ("world", "base"), HERE)
    assert len(urdf.parse(description(extra), "/robot_description")) == 7


class JointRobot(Robot):
    """The same robot, told by joints: it goes from one row of values to the next."""

    def __post_init__(self):
        super().__post_init__()
        self.rows = self.rng.uniform(-0.8, 0.8, (self.stations, 6))

    def values(self, t):
        index = min(int(t / PERIOD), self.stations - 1)
        s = np.clip((t - index * PERIOD - PAUSE) / MOVE, 0.0, 1.0)
        smooth = s**3 * (10 - 15 * s + 6 * s**2)
        after = self.rows[min(index + 1, self.stations - 1)]
        return (1 - smooth) * self.rows[index] + smooth * after

    def joints(self):
        for t in np.arange(0.0, self.duration, 1 / self.rate):
            noisy = self.values(t) + self.rng.normal(0.0, self.noise, 6)
            names = [name for name, *_ in ARM]
            payload = ros2.joint_state(ns(t), dict(zip(names, noisy.tolist(), strict=True)))
            yield ns(t + 0.002), "/joint_states", "sensor_msgs/msg/JointState", payload

    def described(self, text=None):
        payload = ros2.text(description() if text is None else text)
        return [(ns(0), "/robot_description", "std_msgs/msg/String", payload)]

    def mounted(self):
        still = (0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0)
        payload = ros2.transforms((ns(0), "flange", "camera_optical", still))
        return [(ns(0), "/tf_static", "tf2_msgs/msg/TFMessage", payload)]

    def streams(self):
        return self.described(), self.joints(), self.mounted(), self.images(), self.infos()


@pytest.fixture(scope="module")
def robot():
    return JointRobot()


@pytest.fixture(scope="module")
def path(tmp_path_factory, robot):
    return write(tmp_path_factory.mktemp("joints") / "a.mcap", in_order(*robot.streams()))


def test_stations_of_a_recording_without_moving_frames(path, robot):
    record = recording.read(path, OPTIONS)
    assert len(record.stations) == robot.stations
    # means of at least 50 samples of six joints, with levers of at most a metre and a half
    expected = robot.noise * np.sqrt(6 * (1 + 1.5**2) / 50)
    for station, row in zip(record.stations, robot.rows, strict=True):
        way = se3.difference(station.base_T_gripper, by_hand(row))
        assert np.linalg.norm(way) < 4 * expected
    codes = [finding.code for finding in record.findings]
    assert "links-computed" in codes
    choices = next(f for f in record.findings if f.code == "recording-choices")
    assert "base 'base', gripper 'link_6'" in choices.message


def test_the_gripper_can_be_a_link_that_is_fixed_to_the_last_one(path, robot):
    options = McapOptions(setup=Setup.EYE_IN_HAND, gripper_frame="flange")
    record = recording.read(path, options)
    flange = se3.from_parts(Rotation.from_euler("xyz", FLANGE[1]).as_matrix(), FLANGE[0])
    way = se3.difference(record.stations[1].base_T_gripper, by_hand(robot.rows[1]) @ flange)
    assert np.linalg.norm(way) < 1e-3


def test_the_summary_shows_the_links_of_the_joints(path):
    summary = recording.look(path, OPTIONS, {}).inspection.recording
    assert summary.used.frames == ("base", *(f"link_{i}" for i in range(1, 7)))
    roles = {topic.name: topic.role for topic in summary.topics}
    assert (roles["/joint_states"], roles["/robot_description"]) == ("joints", "text")


def test_frames_that_move_win_over_joints(tmp_path, robot):
    streams = [*robot.streams()[:2], robot.static(), robot.links(), robot.images()]
    content = survey.take(write(tmp_path / "a.mcap", in_order(*streams)))
    assert content.computed == 0
    assert {link.child for link in content.links} == {
        "base_link",
        "link_1",
        "wrist",
        "camera_optical",
    }


def test_a_description_that_is_none_is_told_with_what_is_missing(tmp_path, robot):
    streams = (robot.described("<robot><joint/></robot>"), *robot.streams()[1:])
    with pytest.raises(InputError, match="expected a moving frame") as caught:
        recording.read(write(tmp_path / "a.mcap", in_order(*streams)), OPTIONS)
    assert "expected a type of joint" in caught.value.message
    assert "/robot_description" in caught.value.message


def test_other_texts_are_passed_over(tmp_path, robot):
    chatter = [(ns(t), "/log", "std_msgs/msg/String", ros2.text("all is well")) for t in range(3)]
    content = survey.take(write(tmp_path / "a.mcap", in_order(*robot.streams(), chatter)))
    assert content.computed == 7
    assert content.unreadable == {}
