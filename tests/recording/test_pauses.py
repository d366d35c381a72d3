"""Pauses found in poses whose motion is known."""

import numpy as np
import pytest
from recording.bags import MOVE, PAUSE, PERIOD, Robot

from handeye_cli.geometry import se3
from handeye_cli.recording.options import PauseThresholds
from handeye_cli.recording.pauses import find_pauses

SECOND = 1_000_000_000
DEFAULTS = PauseThresholds()
TRIM = 0.27
"""At most this long an end of a pause is left out with the motion beside it, seconds."""


def walk(robot, rate, *, jitter=0.0):
    seconds = np.arange(0.0, robot.duration, 1 / rate)
    seconds = np.sort(seconds + robot.rng.uniform(0, jitter / rate, len(seconds)))
    poses = np.stack([robot.noisy(robot.upper, t) for t in seconds])
    return np.round(seconds * SECOND).astype(np.int64), poses


def straight(rate, way, duration):
    """Poses along x at `way(t)` metres."""
    seconds = np.arange(0.0, duration, 1 / rate)
    t = np.zeros((len(seconds), 3))
    t[:, 0] = way(seconds)
    return (seconds * SECOND).astype(np.int64), se3.from_parts(np.eye(3), t)


@pytest.mark.parametrize("rate", [15.0, 30.0, 50.0, 125.0, 500.0])
@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_every_pause_is_found_and_nothing_of_the_motion(rate, noise):
    robot = Robot(seed=3, stations=5, noise=noise)
    times, poses = walk(robot, rate, jitter=0.5)
    pauses = find_pauses(times, poses, DEFAULTS) / SECOND
    assert pauses.shape == (5, 2)
    begin = np.arange(5) * PERIOD
    settled = 0.06 * MOVE  # the smooth motion's first part is shorter than the noise
    assert (pauses[:, 0] >= begin - settled).all()
    assert (pauses[:, 0] <= begin + TRIM).all()
    assert (pauses[:, 1] <= begin + PAUSE + settled).all()
    assert (pauses[:, 1] >= begin + PAUSE - TRIM).all()


def test_intervals_are_half_open_and_hold_their_own_ends():
    times, poses = straight(50.0, np.zeros_like, 2.0)
    pauses = find_pauses(times, poses, DEFAULTS)
    assert pauses.tolist() == [[times[0], times[-1] + 1]]


def test_time_of_day_costs_no_accuracy():
    times, poses = walk(Robot(seed=4, noise=1e-4), 100.0)
    here = find_pauses(times, poses, DEFAULTS)
    late = find_pauses(times + 1_700_000_000 * SECOND, poses, DEFAULTS)
    np.testing.assert_array_equal(late - 1_700_000_000 * SECOND, here)


def test_slow_creeping_is_no_pause():
    times, poses = straight(100.0, lambda t: 2e-3 * t, 4.0)
    assert len(find_pauses(times, poses, DEFAULTS)) == 0


@pytest.mark.parametrize("rate", [0.05, 0.002])
def test_turning_in_place_is_no_pause(rate):
    seconds = np.arange(0.0, 4.0, 0.01)
    turn = np.zeros((len(seconds), 6))
    turn[:, 5] = rate * seconds
    poses = se3.perturb(np.eye(4), turn)
    assert len(find_pauses((seconds * SECOND).astype(np.int64), poses, DEFAULTS)) == 0


def test_point_of_return_is_no_pause():
    times, poses = straight(100.0, lambda t: 0.1 * np.cos(np.pi * t), 4.0)
    assert len(find_pauses(times, poses, DEFAULTS)) == 0


def test_short_standstill_is_no_pause():
    def way(t):
        return 0.2 * np.minimum(t, 1.0) + 0.2 * np.maximum(t - 1.3, 0.0)

    times, poses = straight(100.0, way, 2.0)
    assert len(find_pauses(times, poses, DEFAULTS)) == 0
    shorter = PauseThresholds(min_duration_ns=50_000_000)
    assert len(find_pauses(times, poses, shorter)) == 1


def test_fast_recording_raises_the_speed_of_a_pause():
    def way(t):
        sway = 1.5e-3 * np.sin(np.pi * np.clip((t - 0.9) / 0.2, 0.0, 1.0)) ** 2
        return sway + 1.0 * np.maximum(t - 2.0, 0.0)

    times, poses = straight(100.0, way, 4.0)
    assert len(find_pauses(times, poses, DEFAULTS)) == 1
    assert len(find_pauses(times, poses, PauseThresholds(relative=0.0))) == 2


def test_silence_ends_a_pause():
    times, poses = straight(100.0, np.zeros_like, 4.0)
    keep = (times < 1.5 * SECOND) | (times > 2.2 * SECOND)
    pauses = find_pauses(times[keep], poses[keep], DEFAULTS)
    assert len(pauses) == 2
    assert pauses[0, 1] <= 1.5 * SECOND
    assert pauses[1, 0] >= 2.2 * SECOND


def test_slow_pose_source_is_not_silent():
    times, poses = straight(1.0, np.zeros_like, 10.0)
    assert len(find_pauses(times, poses, DEFAULTS)) == 1


@pytest.mark.parametrize("count", [0, 1, 2])
def test_next_to_no_poses_give_no_pause(count):
    times = np.arange(count, dtype=np.int64) * 10_000_000
    poses = np.broadcast_to(np.eye(4), (count, 4, 4))
    assert find_pauses(times, poses, DEFAULTS).shape == (0, 2)
