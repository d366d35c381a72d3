"""Closed forms of tails against another library, and trimming against simulation."""

import numpy as np
import pytest
from scipy import stats

from handeye_cli.geometry.tails import chance_of_squares, trimmed_variance

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
