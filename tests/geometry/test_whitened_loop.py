"""Whitened loops against the normal equations and the solver that uses them."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import disturbed, general_scene, joint_covariance, problem

from handeye_cli.geometry import se3
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.geometry.whitened_loop import least_squares, whiten
from handeye_cli.records import Noise
from handeye_cli.solvers import Solution, maximum_likelihood

NOISE = Noise(1e-3, 2e-4, 5e-4, 1e-4)


def whitened(seed=1, count=6):
    rng = np.random.default_rng(seed)
    perfect = general_scene(rng, count)
    joint = joint_covariance(count, NOISE)
    A = disturbed(rng, perfect.A, joint[:, :6, :6])
    B = disturbed(rng, perfect.B, joint[:, 6:, 6:])
    loop = loop_jacobians(A, B, perfect.X, perfect.Z)
    return perfect, loop, joint, whiten(loop, joint)


def test_residuals_have_unit_covariance():
    _, _, joint, loops = whitened()
    seen = loops.by_poses @ joint @ np.swapaxes(loops.by_poses, -1, -2)
    np.testing.assert_allclose(seen, np.tile(np.eye(6), (6, 1, 1)), atol=1e-9)


def test_the_step_is_that_of_the_normal_equations():
    _, loop, joint, loops = whitened()
    by_poses = np.concatenate([loop.by_robot, loop.by_camera], axis=-1)
    weight = np.linalg.inv(by_poses @ joint @ np.swapaxes(by_poses, -1, -2))
    J = loop.by_unknowns
    normal = np.einsum("nai,nab,nbj->ij", J, weight, J)
    gradient = np.einsum("nai,nab,nb->i", J, weight, loop.residuals)
    step, _ = least_squares(loops, np.eye(12), np.zeros(12))
    np.testing.assert_allclose(step, -np.linalg.solve(normal, gradient), rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("held", [0, 2, 5])
def test_a_fixed_direction_keeps_its_value_and_the_rest_is_best(held):
    _, _, _, loops = whitened(2)
    basis, fixed = np.delete(np.eye(12), held, axis=1), 3e-3 * np.eye(12)[held]
    step, influence = least_squares(loops, basis, fixed)
    assert step[held] == pytest.approx(3e-3, abs=1e-15)
    np.testing.assert_array_equal(influence[:, held], 0.0)
    left = (loops.residuals + loops.design @ step).reshape(-1)
    slopes = loops.design.reshape(-1, 12).T @ left
    size = np.linalg.norm(loops.design.reshape(-1, 12), axis=0) * np.linalg.norm(left)
    assert np.all(np.abs(np.delete(slopes / size, held)) < 1e-9)
    assert abs(slopes[held] / size[held]) > 1e-3


def test_the_influence_is_that_of_maximum_likelihood():
    perfect, _, joint, _ = whitened(3)
    solution = Solution(perfect.X, perfect.Z)
    expected = maximum_likelihood.influence(problem(perfect, NOISE), solution)
    loops = whiten(loop_jacobians(perfect.A, perfect.B, perfect.X, perfect.Z), joint)
    _, found = least_squares(loops, np.eye(12), np.zeros(12))
    np.testing.assert_allclose(found, expected, atol=1e-8)


def test_a_null_direction_at_the_smallest_noise_stays_null():
    """In the normal equations rounding would show an information of a hundred there."""
    perfect, *_ = whitened(4)
    still = np.tile(perfect.A[:1], (6, 1, 1))
    B = se3.inverse(perfect.X) @ se3.inverse(still) @ perfect.Z
    loop = loop_jacobians(still, B, perfect.X, perfect.Z)
    loops = whiten(loop, joint_covariance(6, Noise(1e-9, 1e-9, 1e-9, 1e-9)))
    constant = np.linalg.qr(loops.design[..., 6:].reshape(-1, 6))[0]
    answer = loops.design[..., :6].reshape(-1, 6)
    left = answer - constant @ (constant.T @ answer)
    assert np.sum(left**2) < 1e-6
