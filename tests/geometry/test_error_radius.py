"""Radii of error magnitudes against SciPy's chi and F distributions, and sampled vectors."""

import numpy as np
import pytest
from scipy import stats

from handeye_cli.geometry.error_radius import MAX_OVER_RMS, radius

FREEDOMS = [2.0, 3.5, 20.0, 100.0]


def rotated(eigenvalues: list[float], seed: int) -> np.ndarray:
    """Covariance with these eigenvalues along random axes."""
    Q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(len(eigenvalues),) * 2))
    return Q @ np.diag(eigenvalues) @ Q.T


def sampled_share(covariance, limit: float, freedom: float, seed: int, trials: int) -> float:
    """Share of sampled magnitudes below the limit when the scale was estimated."""
    rng = np.random.default_rng(seed)
    size, axes = np.linalg.eigh(covariance)
    drawn = rng.normal(size=(trials, len(size))) * np.sqrt(np.maximum(size, 0.0)) @ axes.T
    scale = 1.0 if np.isinf(freedom) else np.sqrt(rng.chisquare(freedom, trials) / freedom)
    return float(np.mean(np.linalg.norm(drawn, axis=1) < limit * scale))


@pytest.mark.parametrize("sigma", [1e-9, 1.0, 1e6])
@pytest.mark.parametrize("probability", [0.05, 0.5, 0.9, 0.95])
def test_isotropic_radius_is_the_chi_quantile(probability, sigma):
    expected = sigma * stats.chi.ppf(probability, 3)
    assert radius(sigma**2 * np.eye(3), probability) == pytest.approx(expected, rel=3e-4)


@pytest.mark.parametrize("freedom", FREEDOMS)
@pytest.mark.parametrize("probability", [0.05, 0.5, 0.95])
def test_isotropic_radius_of_an_estimated_scale_is_the_f_quantile(probability, freedom):
    expected = np.sqrt(3 * stats.f.ppf(probability, 3, freedom))
    assert radius(np.eye(3), probability, freedom) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("freedom", [np.inf, 4.0, 30.0])
@pytest.mark.parametrize("probability", [0.5, 0.95])
@pytest.mark.parametrize(
    "eigenvalues", [[1.0, 0.5, 0.2], [1.0, 0.3, 0.3], [1.0, 1.0, 0.1], [1.0, 0.1, 0.01]]
)
def test_unequal_directions_against_samples(eigenvalues, probability, freedom):
    covariance = rotated(eigenvalues, 1)
    trials = 100_000
    limit = radius(covariance, probability, freedom)
    share = sampled_share(covariance, limit, freedom, 2, trials)
    chance = 4 * np.sqrt(probability * (1 - probability) / trials)
    assert share == pytest.approx(probability, abs=chance)


@pytest.mark.parametrize("freedom", FREEDOMS)
@pytest.mark.parametrize("rank", [1, 2])
def test_directions_without_error_do_not_count(rank, freedom):
    covariance = rotated([2.0] * rank + [0.0] * (3 - rank), 3)
    expected = np.sqrt(2.0 * rank * stats.f.ppf(0.95, rank, freedom))
    assert radius(covariance, 0.95, freedom) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("rank", [1, 2])
def test_a_known_scale_with_directions_without_error(rank):
    covariance = rotated([2.0] * rank + [0.0] * (3 - rank), 4)
    expected = np.sqrt(2.0) * stats.chi.ppf(0.95, rank)
    assert radius(covariance, 0.95) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("probability", [0.95, 0.99, 0.999])
def test_one_dominant_direction_is_the_normal_quantile(probability):
    expected = stats.norm.ppf(0.5 + probability / 2.0)
    assert radius(np.diag([1.0, 0.0, 0.0]), probability) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("freedom", [1.0, 2.0])
def test_few_degrees_of_freedom(freedom):
    expected = np.sqrt(3 * stats.f.ppf(0.95, 3, freedom))
    assert radius(np.eye(3), 0.95, freedom) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("freedom", [0.99, 0.0, -1.0, np.nan])
def test_less_than_one_degree_of_freedom_is_refused(freedom):
    with pytest.raises(ValueError, match="at least 1 degree of freedom"):
        radius(np.eye(3), 0.95, freedom)


@pytest.mark.parametrize("freedom", [np.inf, 5.0])
def test_no_covariance_no_radius(freedom):
    assert radius(np.zeros((3, 3)), 0.95, freedom) == 0.0


@pytest.mark.parametrize("freedom", [np.inf, 3.0])
@pytest.mark.parametrize("eigenvalues", [[1.0, 1.0, 1.0], [1.0, 0.4, 0.1]])
def test_the_radius_grows_with_the_probability(eigenvalues, freedom):
    covariance = rotated(eigenvalues, 5)
    radii = [radius(covariance, p, freedom) for p in np.linspace(0.02, 0.98, 25)]
    assert np.all(np.diff(radii) > 0)


def test_the_radius_shrinks_as_the_scale_becomes_known():
    covariance = rotated([1.0, 0.4, 0.1], 6)
    radii = [radius(covariance, 0.95, freedom) for freedom in (2, 4, 8, 16, 1e3, np.inf)]
    assert np.all(np.diff(radii) < 0)
    # Student's correction is of the order 1e-4 at 1e4 degrees of freedom.
    assert radius(covariance, 0.95, 1e4) == pytest.approx(radii[-1], rel=1e-3)


def test_the_radius_scales_with_the_vector_and_not_with_the_axes():
    plain, turned = np.diag([1.0, 0.4, 0.1]), rotated([1.0, 0.4, 0.1], 7)
    assert radius(turned, 0.9) == pytest.approx(radius(plain, 0.9), rel=1e-9)
    assert radius(1e-8 * plain, 0.9) == pytest.approx(1e-4 * radius(plain, 0.9), rel=1e-9)


def test_a_negative_rounding_of_an_eigenvalue_is_taken_as_zero():
    assert radius(np.diag([1.0, 1.0, -1e-17]), 0.9) == radius(np.diag([1.0, 1.0, 0.0]), 0.9)


def test_max_over_rms_is_the_largest_of_a_thousand():
    assert pytest.approx(stats.chi.ppf(0.999, 3) / np.sqrt(3.0), abs=5e-5) == MAX_OVER_RMS
