"""Poses between samples against SciPy, and how fast they change against differences."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.trajectory import Trajectory, between


@pytest.fixture
def samples():
    rng = np.random.default_rng(4)
    times = np.cumsum(rng.uniform(0.005, 0.02, 40))
    turn = np.stack([np.sin(times), 0.5 * times, times**2], axis=1)
    return Trajectory(times, se3.from_parts(rotations.exp(turn), 0.3 * np.cos(turn)))


def test_poses_between_samples_are_scipys(samples):
    rng = np.random.default_rng(5)
    times = rng.uniform(samples.times[0], samples.times[-1], 100)
    found = samples.at(times)
    slerp = Slerp(samples.times, Rotation.from_matrix(samples.poses[:, :3, :3]))
    np.testing.assert_allclose(found[:, :3, :3], slerp(times).as_matrix(), atol=1e-12)
    expected = [np.interp(times, samples.times, samples.poses[:, k, 3]) for k in range(3)]
    np.testing.assert_allclose(found[:, :3, 3], np.stack(expected, axis=1), atol=1e-14)


def test_samples_are_met_and_nothing_is_extrapolated(samples):
    np.testing.assert_allclose(samples.at(samples.times), samples.poses, atol=1e-14)
    outside = samples.at(np.array([samples.times[0] - 1.0, samples.times[-1] + 1.0]))
    np.testing.assert_allclose(outside, samples.poses[[0, -1]], atol=1e-14)
    around = samples.times[[0, 0, -1, -1]] + np.array([-1e-6, 0.0, 0.0, 1e-6])
    assert samples.covers(around).tolist() == [False, True, True, False]


def test_leading_axes_are_those_of_a_loop(samples):
    times = np.linspace(samples.times[0], samples.times[-1], 12).reshape(3, 4)
    poses, velocities = samples.at(times), samples.velocities(times)
    assert poses.shape == (3, 4, 4, 4)
    for i, j in np.ndindex(3, 4):
        np.testing.assert_allclose(poses[i, j], samples.at(times[i, j]), atol=1e-14)
        np.testing.assert_allclose(velocities[i, j], samples.velocities(times[i, j]), atol=1e-12)


def test_velocities_are_those_of_a_steady_motion_at_the_ends_too():
    times = np.linspace(0.0, 1.0, 30)
    spin, speed = np.array([0.3, -1.0, 0.5]), np.array([0.1, 0.2, -0.3])
    start = rotations.exp(np.array([1.0, 2.0, -0.5]))
    poses = se3.from_parts(rotations.exp(times[:, None] * spin) @ start, times[:, None] * speed)
    found = Trajectory(times, poses).velocities(np.array([0.0, 0.013, 0.5, 1.0]))
    expected = np.concatenate([speed, spin])
    np.testing.assert_allclose(found, np.broadcast_to(expected, (4, 6)), atol=1e-10)


def test_a_single_pose_stands_still():
    pose = se3.from_parts(rotations.exp(np.array([0.1, 0.2, 0.3])), np.array([1.0, 2.0, 3.0]))
    alone = Trajectory(np.array([2.0]), pose[None])
    np.testing.assert_allclose(alone.at(np.array([1.0, 2.0, 3.0])), [pose] * 3, atol=1e-15)
    assert not alone.velocities(np.array([1.0, 2.0])).any()


def test_half_way_turns_by_half_the_angle():
    turn = np.array([0.0, 0.0, 3.0])
    end = se3.from_parts(rotations.exp(turn), np.array([2.0, 0.0, 0.0]))
    middle = between(np.eye(4), end, np.array(0.5))
    expected = se3.from_parts(rotations.exp(0.5 * turn), np.array([1.0, 0.0, 0.0]))
    np.testing.assert_allclose(middle, expected, atol=1e-15)
