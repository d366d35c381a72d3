"""Smooth errors of robot poses: tests of them against sampling and plain least squares."""

import numpy as np
import pytest
from scenes import general_scene
from scipy import stats

from handeye_cli.geometry import smooth_fields

COUNT = 12
POSES = general_scene(np.random.default_rng(3), COUNT).A
TRANSLATION = slice(0, 3)


def stations(rng):
    """Residuals of unit variance beside five fitted columns, whitened from something else."""
    root = np.tril(rng.normal(size=(COUNT, 6, 6))) + 4.0 * np.eye(6)
    fitted = rng.normal(size=(COUNT, 6, 5))
    by_robot = rng.normal(size=(COUNT, 6, 6))
    residuals = (root @ rng.normal(size=(COUNT, 6, 1)))[..., 0]
    covariance = root @ np.swapaxes(root, -1, -2)
    white = smooth_fields.whitened(residuals, covariance, fitted, by_robot)
    return residuals, covariance, fitted, by_robot, white


def test_what_is_left_is_that_of_weighted_least_squares():
    residuals, covariance, fitted, _, white = stations(np.random.default_rng(1))
    weight = np.linalg.inv(smooth_fields.block_diagonal(covariance))
    J, e = fitted.reshape(-1, 5), residuals.ravel()
    x = np.linalg.solve(J.T @ weight @ J, J.T @ weight @ e)
    assert white.left @ white.left == pytest.approx((e - J @ x) @ weight @ (e - J @ x), rel=1e-9)
    assert white.freedom == 6 * COUNT - 5


def test_a_trend_is_that_of_plain_least_squares():
    rng = np.random.default_rng(2)
    residuals, covariance, fitted, by_robot, white = stations(rng)
    columns = rng.normal(size=(COUNT, 6, 3))
    found = smooth_fields.trend(white, columns)
    unroot = np.linalg.inv(np.linalg.cholesky(covariance))
    J = (unroot @ np.concatenate([fitted, by_robot @ columns], axis=-1)).reshape(-1, 8)
    e = (unroot @ residuals[..., None]).ravel()
    x, (squares,), *_ = np.linalg.lstsq(J, e, rcond=None)
    np.testing.assert_allclose(found.values, x[5:], rtol=1e-9)
    noise = squares / (6 * COUNT - 8)
    np.testing.assert_allclose(found.covariance, noise * np.linalg.inv(J.T @ J)[5:, 5:], rtol=1e-9)
    ratio = (white.left @ white.left - squares) / 3 / noise
    assert found.chance == pytest.approx(stats.f.sf(ratio, 3, 6 * COUNT - 8), rel=1e-9)


def test_a_column_that_was_fitted_says_nothing():
    rng = np.random.default_rng(4)
    residuals, covariance, fitted, by_robot, _ = stations(rng)
    columns = rng.normal(size=(COUNT, 6, 1))
    nearly = by_robot @ columns * (1.0 + 1e-3 * rng.normal(size=(COUNT, 6, 1)))
    white = smooth_fields.whitened(
        residuals, covariance, np.concatenate([fitted, nearly], axis=-1), by_robot
    )
    assert smooth_fields.trend(white, columns).chance == 1.0


def test_correlations_fall_with_the_distance():
    found = smooth_fields.correlation(POSES, 0.7)
    np.testing.assert_allclose(np.diag(found), 1.0)
    np.testing.assert_allclose(found, found.T)
    assert np.linalg.eigvalsh(found)[0] > -1e-12
    shorter = smooth_fields.correlation(POSES, 0.35)
    off = ~np.eye(COUNT, dtype=bool)
    np.testing.assert_allclose(np.log(shorter[off]), 4.0 * np.log(found[off]), rtol=1e-9)


def test_the_likeness_of_independent_residuals_is_chance():
    rng = np.random.default_rng(5)
    between = smooth_fields.correlation(POSES, 0.7) - np.eye(COUNT)
    chances = []
    for _ in range(300):
        white = stations(rng)[-1]
        field = smooth_fields.field_covariance(white.by_robot, between, TRANSLATION)
        chances.append(white.likeness(field))
    # Uniform between 0 and 1, but for the approximation.
    assert stats.kstest(chances, "uniform").pvalue > 1e-3


def test_the_covariance_of_a_field_is_that_of_its_samples():
    rng = np.random.default_rng(6)
    by_robot = rng.normal(size=(COUNT, 6, 6))
    correlations = smooth_fields.correlation(POSES, 0.7)
    root = np.linalg.cholesky(correlations + 1e-10 * np.eye(COUNT))
    field = np.einsum("ij,tjd->tid", root, rng.normal(size=(20_000, COUNT, 3)))
    moved = np.einsum("iad,tid->tia", by_robot[..., TRANSLATION], field).reshape(20_000, -1)
    expected = smooth_fields.field_covariance(by_robot, correlations, TRANSLATION)
    size = np.sqrt(np.diag(expected))
    apart = (moved.T @ moved / 20_000 - expected) / np.outer(size, size)
    assert np.max(np.abs(apart)) < 6.0 / np.sqrt(20_000)


def test_the_restricted_likelihood_is_that_of_what_is_left():
    """Of any basis of the complement, up to a constant."""
    rng = np.random.default_rng(7)
    basis = np.linalg.qr(rng.normal(size=(9, 2)))[0]
    free = np.linalg.qr(basis, mode="complete")[0][:, 2:]
    residuals = rng.normal(size=9)
    values = []
    for size in (1.0, 3.0):
        root = rng.normal(size=(9, 9)) + size * np.eye(9)
        covariance = root @ root.T
        plain = stats.multivariate_normal(cov=free.T @ covariance @ free)
        ours = smooth_fields.restricted_log_likelihood(residuals, basis, covariance)
        values.append(ours - plain.logpdf(free.T @ residuals))
    assert values[0] == pytest.approx(values[1], rel=1e-9)
