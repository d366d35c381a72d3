"""Noisy stations: sizes of the errors against chi-square, frames, shapes and seeds."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from handeye_cli.geometry import se3
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.records import Noise
from handeye_cli.simulate.poses import noisy_stations, perturbed

NOISE = Noise(
    robot_rotation=1.5e-3, robot_translation=127e-6, camera_rotation=3e-3, camera_translation=76e-6
)


def stations(count: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(99)
    mount = se3.perturb(np.eye(4), rng.normal(size=6))
    target_T_camera = generate_stations(count, 0.17, 0.5)
    return target_T_camera @ np.linalg.inv(mount), np.linalg.inv(target_T_camera)


def test_errors_have_the_given_rms_magnitudes():
    base_T_gripper, camera_T_target = stations(7)
    found = noisy_stations(base_T_gripper, camera_T_target, NOISE, 500, np.random.default_rng(1))
    for noisy, truth, rotation, translation in [
        (found[0], base_T_gripper, NOISE.robot_rotation, NOISE.robot_translation),
        (found[1], camera_T_target, NOISE.camera_rotation, NOISE.camera_translation),
    ]:
        error = se3.difference(noisy, truth)
        freedom = 3 * 500 * 7
        lowest, highest = chi2.ppf([1e-5, 1 - 1e-5], freedom) / freedom
        for part, sigma in ((error[..., :3], translation), (error[..., 3:], rotation)):
            mean_square = np.mean(np.sum(part**2, axis=-1)) / sigma**2
            assert lowest < mean_square < highest


def test_every_axis_and_station_has_its_own_error():
    base_T_gripper, camera_T_target = stations(3)
    found = noisy_stations(base_T_gripper, camera_T_target, NOISE, 4000, np.random.default_rng(2))
    errors = [
        se3.difference(noisy, truth).reshape(4000, 18)
        for noisy, truth in zip(found, (base_T_gripper, camera_T_target), strict=True)
    ]
    scaled = np.concatenate(errors, axis=1)
    sigma = np.concatenate(
        [
            np.tile(np.repeat(pair, 3), 3)
            for pair in (
                (NOISE.robot_translation, NOISE.robot_rotation),
                (NOISE.camera_translation, NOISE.camera_rotation),
            )
        ]
    )
    covariance = np.cov(scaled / sigma * math.sqrt(3.0), rowvar=False)
    # An entry is known to sqrt(2 / 4000) on the diagonal and 1 / sqrt(4000) beside it.
    assert covariance == pytest.approx(np.eye(36), abs=5 * math.sqrt(2 / 4000))
    assert scaled.mean(axis=0) == pytest.approx(np.zeros(36), abs=5 * 3e-3 / math.sqrt(3 * 4000))


def test_translation_error_is_in_the_parent_frame():
    pose = se3.perturb(np.eye(4), np.array([1.0, 2.0, 3.0, 0.5, -0.7, 2.0]))
    noisy = perturbed(pose, None, 1e-3, np.random.default_rng(3), (2,))
    raw = np.random.default_rng(3).standard_normal((2, 6))[:, :3] * 1e-3 / math.sqrt(3.0)
    assert noisy[:, :3, 3] - pose[:3, 3] == pytest.approx(raw, abs=1e-15)
    assert noisy[:, :3, :3] == pytest.approx(np.broadcast_to(pose[:3, :3], (2, 3, 3)), abs=1e-15)


def test_no_noise_leaves_the_poses():
    base_T_gripper, camera_T_target = stations(4)
    found = noisy_stations(base_T_gripper, camera_T_target, Noise(), 3, np.random.default_rng(4))
    assert found[0] == pytest.approx(np.broadcast_to(base_T_gripper, (3, 4, 4, 4)), abs=1e-15)
    assert found[1] == pytest.approx(np.broadcast_to(camera_T_target, (3, 4, 4, 4)), abs=1e-15)


@pytest.mark.parametrize("trials", [(), (5,), (2, 3)])
@pytest.mark.parametrize("batch", [(), (4,)])
def test_leading_axes(trials, batch):
    poses = np.broadcast_to(np.eye(4), (*batch, 4, 4))
    noisy = perturbed(poses, 0.1, 0.1, np.random.default_rng(5), trials)
    assert noisy.shape == (*trials, *batch, 4, 4)
    assert len(np.unique(noisy[..., 0, 3])) == math.prod(trials) * math.prod(batch)


def test_same_seed_same_errors():
    base_T_gripper, camera_T_target = stations(3)
    first, again = (
        noisy_stations(base_T_gripper, camera_T_target, NOISE, 2, np.random.default_rng(6))
        for _ in range(2)
    )
    assert np.array_equal(first, again)
