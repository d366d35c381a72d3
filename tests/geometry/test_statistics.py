"""Median and quantiles against numpy's."""

import numpy as np
import pytest

from handeye_cli.geometry.statistics import median, quantile


@pytest.mark.parametrize("count", [1, 2, 3, 10, 11])
def test_the_median_is_numpys(count):
    values = np.random.default_rng(count).normal(size=count)
    assert median(values) == np.median(values)


@pytest.mark.parametrize("count", [1, 2, 10, 301])
@pytest.mark.parametrize("part", [0.0, 0.15, 0.3, 1.0])
def test_a_quantile_is_numpys(count, part):
    values = np.random.default_rng(count).normal(size=count)
    assert quantile(values, part) == pytest.approx(np.quantile(values, part), abs=1e-12)
