"""Which frames along a robot's way are taken, and when they stand in for stations."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from recording.bags import MOVING_GREY, PERIOD, Robot, in_order, ns, write

from handeye_cli import recording
from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError
from handeye_cli.geometry import rotations, se3
from handeye_cli.recording import McapOptions
from handeye_cli.recording.clock import Clock
from handeye_cli.recording.moving import MOST_FRAMES, MOST_STATIONS, along_the_way
from handeye_cli.recording.pauses import find_pauses
from handeye_cli.recording.timeline import RobotPath, Timeline

OPTIONS = McapOptions(setup=Setup.EYE_IN_HAND)
MS = 1_000_000


@dataclass
class Restless(Robot):
    """A robot that is on its way all the time, but for its two ends."""

    def _at(self, poses, t):
        return super()._at(poses, self.own_time(t))

    def own_time(self, t):
        """The time at which a robot that pauses would have been there: only its motions count."""
        rest = 0.4
        way = np.clip(t - rest, 0.0, None) / (PERIOD - 1.0)
        index = min(int(way), self.stations - 2)
        return index * PERIOD + 1.0 + min(way - index, 1.0) * (PERIOD - 1.0)

    @property
    def duration(self):
        return 0.8 + (self.stations - 1) * (PERIOD - 1.0)


@pytest.fixture(scope="module")
def restless(tmp_path_factory):
    robot = Restless(stations=5)
    return write(tmp_path_factory.mktemp("restless") / "a.mcap", robot.messages())


@pytest.fixture(scope="module")
def pausing(tmp_path_factory):
    return write(tmp_path_factory.mktemp("pausing") / "a.mcap", Robot().messages())


def codes(record):
    return [finding.code for finding in record.findings]


def test_stations_of_a_robot_that_never_pauses_are_frames_on_its_way(restless):
    record = recording.read(restless, OPTIONS)
    assert codes(record) == ["recording-choices", "stations-moving"]
    warning = record.findings[-1]
    assert warning.severity == "warning"
    assert f"{len(record.stations)} of 80 frames" in warning.message
    assert 15 <= len(record.stations) <= MOST_STATIONS
    moving = record.moving
    assert moving.are_stations
    names = [station.name for station in record.stations]
    assert names == [moving.frames[index].name for index in moving.stations]
    np.testing.assert_allclose(
        [station.base_T_gripper for station in record.stations],
        moving.path.at(moving.times[moving.stations]),
    )


def test_a_robot_that_pauses_keeps_its_pauses_and_tells_of_its_way(pausing):
    record = recording.read(pausing, OPTIONS)
    assert len(record.stations) == 4
    assert codes(record) == ["recording-choices", "frames-moving"]
    assert not record.moving.are_stations
    greys = [frame.image.load()[0, 0] for frame in record.moving.frames]
    assert np.mean(np.array(greys) == MOVING_GREY) > 0.8  # at rest there is no way to go


def test_frames_in_motion_can_be_asked_for(pausing):
    record = recording.read(pausing, replace(OPTIONS, moving=True))
    assert record.moving.are_stations
    assert len(record.stations) == MOST_STATIONS
    assert "4 pauses of the robot" in record.findings[-1].message


def test_a_given_offset_is_in_the_times(restless):
    early = recording.read(restless, OPTIONS).moving
    late = recording.read(restless, replace(OPTIONS, time_offset_ns=40 * MS)).moving
    assert (early.given, late.given) == (0.0, 0.04)
    of_frame = [frame.image.time_ns for frame in (*early.frames, *late.frames)]
    # the pose of both links is known from 3 ms on
    seconds = (np.array(of_frame) - ns(0.003)) / 1e9
    np.testing.assert_allclose(seconds, [*early.times, *late.times], atol=1e-8)
    taken = early.frames[0].image.time_ns, late.frames[0].image.time_ns
    assert taken == (ns(0.01), ns(0.05))


def test_a_robot_of_two_pauses_does_not_count_as_one_that_never_rests(tmp_path):
    path = write(tmp_path / "a.mcap", Robot(stations=2).messages())
    assert not recording.read(path, OPTIONS).moving.are_stations


def test_too_short_a_way_is_refused(tmp_path):
    robot = Robot(stations=2)
    moving = [m for m in robot.messages() if robot.moving((m[0] - ns(0)) / 1e9) or "static" in m[1]]
    images = [message for message in moving if "image_raw" in message[1]]
    few = in_order([message for message in moving if message not in images[9:]])
    with pytest.raises(InputError, match=r"found no pause in 0\.8 s .* fewer than 10 frames"):
        recording.read(write(tmp_path / "a.mcap", few), OPTIONS)


def line_of(times_ns, poses, images_ns):
    robot = RobotPath(times_ns, poses)
    pauses = find_pauses(times_ns, poses, OPTIONS.pauses)
    return Timeline(Clock.STAMP, None, images_ns, robot, pauses, ())


def turning(seconds, angle):
    """Poses that turn about z."""
    return se3.from_parts(
        rotations.exp(angle(seconds)[:, None] * np.array([0.0, 0.0, 1.0])), np.zeros(3)
    )


def test_frames_lie_at_even_turns_however_fast_these_are():
    seconds = np.arange(0.0, 20.0, 0.01)
    line = line_of(
        (1e9 * seconds).astype(np.int64),
        turning(seconds, lambda t: 0.02 * t**2),
        (1e9 * np.arange(0.0, 19.9, 0.02)).astype(np.int64),
    )
    chosen = along_the_way(line)
    assert len(chosen) == MOST_FRAMES
    steps = np.diff(0.02 * (line.image_times_ns[chosen] / 1e9) ** 2)
    whole = 0.02 * 19.88**2
    # a frame is taken every 0.02 s, at up to 0.8 rad/s
    np.testing.assert_allclose(steps, whole / (MOST_FRAMES - 1), atol=0.017)


def test_images_in_the_wrong_order_are_sorted():
    seconds = np.arange(0.0, 5.0, 0.01)
    images = (1e9 * np.arange(0.0, 4.9, 0.05)).astype(np.int64)[::-1]
    line = line_of((1e9 * seconds).astype(np.int64), turning(seconds, lambda t: 0.5 * t), images)
    times = line.image_times_ns[along_the_way(line)]
    assert (np.diff(times) > 0).all()


def test_frames_without_a_pose_of_their_time_are_passed_over():
    seconds = np.arange(0.0, 10.0, 0.01)
    seconds = seconds[(seconds < 3.0) | (seconds > 6.0)]
    images = (1e9 * np.arange(-1.0, 12.0, 0.1)).astype(np.int64)
    line = line_of((1e9 * seconds).astype(np.int64), turning(seconds, lambda t: 0.3 * t), images)
    taken = line.image_times_ns[along_the_way(line)] / 1e9
    assert taken.min() >= 0.0
    assert taken.max() <= 10.0
    assert not ((taken > 3.0) & (taken < 6.0)).any()


def test_a_robot_at_rest_has_no_way():
    seconds = np.arange(0.0, 10.0, 0.01)
    images = (1e9 * np.arange(0.0, 9.0, 0.1)).astype(np.int64)
    line = line_of((1e9 * seconds).astype(np.int64), turning(seconds, np.zeros_like), images)
    assert len(along_the_way(line)) == 0


def test_frames_are_not_loaded_before_they_are_looked_at(restless, tmp_path):
    copy = tmp_path / "copy.mcap"
    copy.write_bytes(Path(restless).read_bytes())
    record = recording.read(str(copy), OPTIONS)
    copy.unlink()
    with pytest.raises(InputError, match="No such file"):
        record.moving.frames[0].image.load()
