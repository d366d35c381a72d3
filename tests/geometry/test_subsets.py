"""Subsets: all of few, a fixed choice of many."""

from math import comb

import numpy as np
import pytest

from handeye_cli.geometry.subsets import subsets


@pytest.mark.parametrize(("count", "size"), [(4, 2), (7, 3), (3, 3)])
def test_all_of_few(count, size):
    found = subsets(count, size, 1000)
    assert len({frozenset(row) for row in found.tolist()}) == len(found) == comb(count, size)


@pytest.mark.parametrize("size", [2, 3])
def test_many_are_drawn_alike_every_time(size):
    found = subsets(8000, size, 100)
    assert found.shape == (100, size)
    assert all(len(set(row)) == size for row in found.tolist())
    np.testing.assert_array_equal(found, subsets(8000, size, 100))
    # the mean of so many evenly drawn numbers is within four standard deviations
    assert abs(found.mean() - 4000) < 4 * 8000 / np.sqrt(12 * found.size)


def test_a_little_more_than_the_most_is_drawn_from_all():
    assert set(subsets(9, 3, 60).ravel().tolist()) == set(range(9))
