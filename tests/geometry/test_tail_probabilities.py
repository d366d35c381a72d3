import math

import numpy as np
import pytest
from scipy import stats

from handeye_cli.geometry.tail_probabilities import (
    chance_of_squares,
    chi_square_head,
    chi_square_tail,
    f_tail,
    normal_tail,
    quadratic_ratio_tail,
    trimmed_variance,
)


@pytest.mark.parametrize("count", [0.4, 1.0, 2.0, 7.5, 60.0, 3000.0, 20000.0])
def test_chi_square_is_that_of_scipy(count):
    for squares in stats.chi2.ppf([1e-9, 1e-3, 0.3, 0.7, 1 - 1e-3, 1 - 1e-9], count):
        assert chi_square_tail(squares, count) == pytest.approx(
            stats.chi2.sf(squares, count), rel=1e-9
        )
        assert chi_square_head(squares, count) == pytest.approx(
            stats.chi2.cdf(squares, count), rel=1e-9
        )


@pytest.mark.parametrize("above", [1.0, 3.0, 20.0, 900.0])
@pytest.mark.parametrize("below", [1.0, 4.5, 60.0, 30000.0])
def test_f_is_that_of_scipy(above, below):
    for ratio in stats.f.ppf([1e-3, 0.2, 0.8, 1 - 1e-3, 1 - 1e-9], above, below):
        assert f_tail(ratio, above, below) == pytest.approx(
            stats.f.sf(ratio, above, below), rel=1e-8
        )


def test_f_of_a_known_scale_is_chi_square():
    assert f_tail(2.5, 3.0, math.inf) == pytest.approx(stats.chi2.sf(7.5, 3.0))


def test_nothing_and_less_is_always_exceeded():
    assert chi_square_tail(0.0, 3.0) == f_tail(-1.0, 3.0, 5.0) == 1.0
    assert chi_square_head(0.0, 3.0) == 0.0


def test_normal_tail_far_out():
    for value in (-3.0, 0.0, 1.5, 9.0):
        assert normal_tail(value) == pytest.approx(stats.norm.sf(value), rel=1e-12)


@pytest.mark.parametrize("count", [6, 40])
def test_ratio_of_quadratic_forms_against_sampling(count):
    rng = np.random.default_rng(count)
    weights = rng.normal(size=count) ** 3
    squares = rng.normal(size=(200_000, count)) ** 2
    ratios = squares @ weights / squares.sum(axis=1)
    for chance in (0.5, 0.1, 0.01, 0.001):
        found = quadratic_ratio_tail(weights, float(np.quantile(ratios, 1 - chance)))
        # Four standard deviations of the sampling, and the approximation's own fifth.
        assert abs(found - chance) < 4 * np.sqrt(chance / 200_000) + 0.2 * chance


def test_two_squares_are_a_beta_distribution():
    ratio = 0.999
    exact = stats.beta.sf(ratio, 0.5, 0.5)
    assert quadratic_ratio_tail(np.array([1.0, 0.0]), ratio) == pytest.approx(exact, rel=0.25)


def test_ratios_out_of_reach():
    weights = np.array([0.5, 1.0, 2.0])
    assert quadratic_ratio_tail(weights, 2.0) == 0.0
    assert quadratic_ratio_tail(weights, 0.4) == 1.0
    assert quadratic_ratio_tail(np.ones(4), 1.0) == 0.0


SQUARES = np.array([0.0, 1e-6, 0.5, 6.0, 40.0, 300.0])


@pytest.mark.parametrize("count", [2, 6, 12])
def test_known_scale_is_chi_square(count):
    chances = chance_of_squares(SQUARES, count)
    np.testing.assert_allclose(chances, stats.chi2.sf(SQUARES, count), rtol=1e-10)


@pytest.mark.parametrize("count", [2, 6, 12])
@pytest.mark.parametrize("freedom", [1.0, 2.7, 30.0, 4e4])
def test_estimated_scale_is_f(count, freedom):
    chances = chance_of_squares(SQUARES, count, freedom)
    np.testing.assert_allclose(chances, stats.f.sf(SQUARES / count, count, freedom), rtol=1e-8)


def test_known_and_estimated_scales_mix():
    freedom = np.array([np.inf, 3.0, np.inf])
    expected = [float(chance_of_squares(9.0, 6, each)) for each in freedom]
    np.testing.assert_array_equal(chance_of_squares(np.full(3, 9.0), 6, freedom), expected)


def test_an_odd_count_is_refused():
    with pytest.raises(ValueError, match="found 3"):
        chance_of_squares(1.0, 3)


@pytest.mark.parametrize("fraction", [0.5, 0.8])
def test_trimmed_variance_is_that_of_the_shortest(fraction):
    vectors = np.random.default_rng(1).normal(size=(200_000, 6))
    squares = np.sort(np.sum(vectors**2, axis=1))[: int(fraction * len(vectors))]
    # the spread of a square is about its mean, and there are more than 1e5 of them
    assert trimmed_variance(fraction, 6) == pytest.approx(np.mean(squares) / 6, rel=0.01)


def test_nothing_trimmed_is_the_whole_variance():
    assert trimmed_variance(1.0, 6) == 1.0
