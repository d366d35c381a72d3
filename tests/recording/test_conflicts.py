"""Links that two nodes tell differently are found out; robots that move fast are believed."""

import struct

import numpy as np
import pytest
from recording import ros2
from recording.bags import SECOND, START, Robot, in_order, ns, pose_numbers, write
from scipy.spatial.transform import Rotation

from handeye_cli import recording
from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError
from handeye_cli.geometry import se3
from handeye_cli.recording import McapOptions
from handeye_cli.recording.conflicts import jumps
from handeye_cli.recording.transforms import Samples

OPTIONS = McapOptions(setup=Setup.EYE_IN_HAND)


def link(seconds, places, turns=None, *, stamped=True):
    """Samples at some times: places in metres, and turns about z in radians."""
    angles = np.zeros(len(seconds)) if turns is None else turns
    q = Rotation.from_rotvec(np.outer(angles, [0.0, 0.0, 1.0])).as_quat()
    times = START + np.rint(np.asarray(seconds) * SECOND).astype(np.int64)
    stamps = times if stamped else np.zeros_like(times)
    return Samples("base", "tool", False, stamps, times, np.concatenate([places, q], axis=1))


def zigzag(seconds, speed, hertz):
    """A tool that is thrown to and fro along x, at some speed in the middle of its way."""
    rate = 2 * np.pi * hertz
    return np.outer(speed / rate * np.sin(rate * seconds), [1.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("period", "speed", "hertz"),
    [(0.002, 2.0, 2.0), (0.01, 2.0, 2.0), (0.2, 0.7, 2.3), (1.0, 2.0, 0.4)],
)
def test_a_robot_that_moves_fast_is_at_one_place_at_a_time(period, speed, hertz):
    rng = np.random.default_rng(1)
    seconds = np.arange(0.0, 20.0, period)
    places = zigzag(seconds, speed, hertz) + rng.normal(0.0, 1e-4, (len(seconds), 3))
    assert jumps(link(seconds, places, 3.0 * np.sin(2.0 * seconds))) == (0, 0.0)


@pytest.mark.parametrize("rates", [(50, 50), (125, 50), (500, 10)])
@pytest.mark.parametrize("stamped", [True, False])
def test_two_nodes_are_found_out_whatever_their_rates(rates, stamped):
    rng = np.random.default_rng(2)
    one, other = (np.sort(rng.uniform(0.0, 10.0, 10 * rate)) for rate in rates)
    seconds = np.concatenate([one, other])
    offset = np.repeat([[0.0, 0.0, 0.0], [0.0, 0.06, 0.08]], [len(one), len(other)], axis=0)
    count, far = jumps(link(seconds, zigzag(seconds, 0.2, 0.5) + offset, stamped=stamped))
    assert count > 0.5 * min(len(one), len(other))
    # while one node is silent the tool moves on, by less than 0.2 m/s in 0.1 s
    assert far == pytest.approx(0.1, abs=0.01)


def test_two_orientations_count_as_well_and_the_sign_of_a_quaternion_does_not():
    seconds = np.arange(0.0, 5.0, 0.01)
    every_other = np.arange(len(seconds)) % 2
    count, far = jumps(link(seconds, np.zeros((len(seconds), 3)), 0.04 * every_other))
    assert count == len(seconds) - 2
    assert far == pytest.approx(0.02, rel=1e-3)
    still = link(seconds, np.zeros((len(seconds), 3)))
    still.numbers[every_other == 1, 3:] *= -1.0
    assert jumps(still) == (0, 0.0)


def test_two_poses_of_one_time_are_two():
    seconds = np.concatenate([np.arange(0.0, 5.0, 0.02)] * 2)
    places = np.outer(np.repeat([0.0, 0.3], 250), [1.0, 0.0, 0.0])
    count, far = jumps(link(seconds, places))
    assert count == 498
    assert far == pytest.approx(0.3)


def test_some_wrong_poses_are_not_two_nodes():
    rng = np.random.default_rng(3)
    places = np.zeros((1000, 3))
    places[rng.choice(1000, 4, replace=False)] = 0.5
    assert jumps(link(np.arange(1000) * 0.01, places)) == (0, 0.0)
    assert jumps(link([0.0], np.zeros((1, 3)))) == (0, 0.0)


def test_a_recording_of_two_nodes_is_refused_and_says_whose(tmp_path):
    robot = Robot(stations=2)
    lifted = se3.from_parts(np.eye(3), np.array([0.0, 0.0, 0.1]))

    def second():
        for t in np.arange(0.003, robot.duration, 0.02):
            pose = pose_numbers(robot.noisy(robot.upper, t) @ lifted)
            payload = ros2.transforms((ns(t), "base_link", "link_1", pose))
            yield ns(t + 0.002), "/tf", "tf2_msgs/msg/TFMessage", payload

    path = write(tmp_path / "a.mcap", in_order(robot.messages(), second()))
    with pytest.raises(InputError, match=r"'link_1' in 'base_link' .* by 100\.\d mm") as caught:
        recording.read(path, OPTIONS)
    assert caught.value.where == path
    assert "ros2 topic info -v /tf" in caught.value.hint
    looked = recording.look(path, OPTIONS, {}).inspection
    assert [each.code for each in looked.errors] == ["no-robot-poses"]


def earlier(message, seconds):
    """A message as a clock tells it that was set back."""
    log, topic, schema, payload = message
    at = 8 if topic == "/tf" else 4  # transforms are counted before the first header
    (stamp,) = struct.unpack_from("<i", payload, at)
    payload = payload[:at] + struct.pack("<i", stamp - seconds) + payload[at + 4 :]
    return log - seconds * SECOND, topic, schema, payload


def test_a_clock_that_is_set_back_does_not_mix_two_stations(tmp_path):
    robot = Robot(stations=4)
    middle = ns(robot.duration / 2)
    messages = [each if each[0] < middle else earlier(each, 2) for each in robot.messages()]
    with pytest.raises(InputError, match="jumps to and fro") as caught:
        recording.read(write(tmp_path / "a.mcap", messages), OPTIONS)
    assert "or the clock was set back" in caught.value.hint
