"""The loop's derivatives against central differences, at residuals from zero to 2.5 radians."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handeye_cli.geometry import se3
from handeye_cli.geometry.loop import isotropic_covariance, loop_jacobians

STEP = 1e-5
DIFFERENCE = 1e-9
"""Of a central difference: rounding / STEP, and STEP^2 times a third derivative below 10."""


def random_poses(shape: tuple[int, ...], seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    R = Rotation.from_quat(rng.normal(size=(int(np.prod(shape)), 4))).as_matrix()
    return se3.from_parts(R.reshape(*shape, 3, 3), rng.normal(size=(*shape, 3)))


def scene(shape: tuple[int, ...], count: int, misfit: float, seed: int):
    """A, B, X, Z whose loops stay open by `misfit` radians and metres."""
    rng = np.random.default_rng(seed)
    X, Z = random_poses(shape, seed), random_poses(shape, seed + 1)
    A = random_poses((*shape, count), seed + 2)
    gap = rng.normal(size=(*shape, count, 6))
    gap *= misfit / np.linalg.norm(gap[..., 3:], axis=-1, keepdims=True)
    closed = se3.perturb(np.broadcast_to(Z[..., None, :, :], A.shape), gap)
    B = np.linalg.inv(A @ X[..., None, :, :]) @ closed
    return A, B, X, Z, gap


def numeric(move) -> np.ndarray:
    """Central difference of residuals (6, N, 6) by six perturbations, as (N, 6, 6) columns."""
    steps = STEP * np.eye(6)
    return np.moveaxis((move(steps) - move(-steps)) / (2 * STEP), 0, -1)


@pytest.mark.parametrize("misfit", [0.0, 1e-3, 0.5, 2.5])
def test_residuals_are_what_takes_the_constant_to_the_loop(misfit):
    A, B, X, Z, gap = scene((), 7, misfit, 1)
    assert loop_jacobians(A, B, X, Z).residuals == pytest.approx(gap, abs=1e-13)


@pytest.mark.parametrize("misfit", [0.0, 1e-3, 0.5, 2.5])
def test_derivatives_against_central_differences(misfit):
    A, B, X, Z, _ = scene((), 4, misfit, 5)

    def residuals(A=A, B=B, X=X, Z=Z):
        trials = (6, 4, 4, 4)
        return loop_jacobians(
            np.broadcast_to(A, trials), np.broadcast_to(B, trials), X, Z
        ).residuals

    loop = loop_jacobians(A, B, X, Z)
    by_robot = numeric(lambda d: residuals(A=se3.perturb(A, d[:, None])))
    by_camera = numeric(lambda d: residuals(B=se3.perturb(B, d[:, None])))
    by_answer = numeric(lambda d: residuals(X=se3.perturb(X, d)))
    by_constant = numeric(lambda d: residuals(Z=se3.perturb(Z, d)))
    assert loop.by_robot == pytest.approx(by_robot, abs=DIFFERENCE)
    assert loop.by_camera == pytest.approx(by_camera, abs=DIFFERENCE)
    assert loop.by_unknowns[..., :6] == pytest.approx(by_answer, abs=DIFFERENCE)
    assert loop.by_unknowns[..., 6:] == pytest.approx(by_constant, abs=DIFFERENCE)


def test_an_eye_in_hand_scene_closes():
    """The target stands on the floor; what camera and robot see of it must agree."""
    gripper_T_camera, base_T_target = random_poses((), 9), random_poses((), 10)
    base_T_gripper = random_poses((6,), 11)
    camera_T_target = np.linalg.inv(base_T_gripper @ gripper_T_camera) @ base_T_target
    loop = loop_jacobians(base_T_gripper, camera_T_target, gripper_T_camera, base_T_target)
    assert loop.residuals == pytest.approx(np.zeros((6, 6)), abs=1e-14)
    assert loop.by_unknowns.shape == (6, 6, 12)


def test_the_two_unknowns_are_not_confused():
    """Z moved by its own perturbation leaves minus that perturbation, whatever the stations."""
    A, B, X, Z, _ = scene((), 5, 0.0, 12)
    d = np.array([1e-3, -2e-3, 5e-4, 0.0, 0.0, 3e-3])
    left = loop_jacobians(A, B, X, se3.perturb(Z, d)).residuals
    assert left == pytest.approx(np.broadcast_to(-d, (5, 6)), abs=1e-14)


@pytest.mark.parametrize("shape", [(2,), (2, 3)])
def test_a_batch_is_a_loop(shape):
    A, B, X, Z, _ = scene(shape, 4, 0.3, 13)
    whole = loop_jacobians(A, B, X, Z)
    assert whole.by_unknowns.shape == (*shape, 4, 6, 12)
    for index in np.ndindex(*shape):
        one = loop_jacobians(A[index], B[index], X[index], Z[index])
        assert one.residuals == pytest.approx(whole.residuals[index], abs=1e-14)
        assert one.by_robot == pytest.approx(whole.by_robot[index], abs=1e-13)
        assert one.by_camera == pytest.approx(whole.by_camera[index], abs=1e-13)
        assert one.by_unknowns == pytest.approx(whole.by_unknowns[index], abs=1e-13)


def test_many_answers_share_the_stations():
    """Trials of X and Z along a leading axis need no copies of the stations."""
    A, B, X, Z, _ = scene((), 4, 0.2, 14)
    tried = se3.perturb(X, 0.1 * np.random.default_rng(15).normal(size=(3, 6)))
    whole = loop_jacobians(A, B, tried, Z)
    for k in range(3):
        one = loop_jacobians(A, B, tried[k], Z)
        assert one.residuals == pytest.approx(whole.residuals[k], abs=1e-13)


@pytest.mark.parametrize(("rotation", "translation"), [(1.5e-3, 1.3e-4), (0.0, 2.0), (0.3, 0.0)])
def test_isotropic_covariance_has_the_magnitudes(rotation, translation):
    covariance = isotropic_covariance(rotation, translation)
    trials = 40_000
    white = np.random.default_rng(16).normal(size=(trials, 6))
    sampled = white @ np.sqrt(covariance)
    # The mean square of a 3-vector has the relative deviation sqrt(2 / (3 trials)).
    spread = 4 * np.sqrt(2 / (3 * trials))
    squares = np.mean(np.sum(sampled.reshape(trials, 2, 3) ** 2, axis=-1), axis=0)
    assert squares == pytest.approx([translation**2, rotation**2], rel=spread)
    assert np.array_equal(covariance, np.diag(np.diag(covariance)))
