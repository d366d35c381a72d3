"""Pattern search on functions whose minimum is known."""

import numpy as np
import pytest

from handeye_cli.planning.pattern import minimise


def test_it_finds_the_minimum_of_a_tilted_bowl_from_every_start():
    rng = np.random.default_rng(2)
    goal = np.array([0.3, -1.2, 0.7])
    shape = np.array([[2.0, 0.9, 0.0], [0.9, 1.0, 0.2], [0.0, 0.2, 0.5]])

    def bowl(x):
        return np.einsum("mi,ij,mj->m", x - goal, shape, x - goal)

    found, values = minimise(bowl, rng.normal(size=(8, 3)), np.full(3, 0.5), finest=1e-6)
    assert found == pytest.approx(np.tile(goal, (8, 1)), abs=1e-4)
    assert values == pytest.approx(0.0, abs=1e-8)


def test_it_never_enters_what_is_forbidden_and_leaves_fixed_coordinates():
    def merit(x):
        return np.where(x[:, 0] >= 0.25, np.sum(x**2, axis=1), np.inf)

    start = np.array([[1.0, 1.0, 0.4]])
    found, _ = minimise(merit, start, np.array([0.3, 0.3, 0.0]), finest=1e-7, rounds=200)
    assert found[0] == pytest.approx([0.25, 0.0, 0.4], abs=1e-5)
    assert found[0, 0] >= 0.25
    assert found[0, 2] == 0.4


def test_it_is_never_worse_than_its_start():
    rng = np.random.default_rng(3)
    rough = rng.normal(size=(40, 2))

    def merit(x):
        return np.sin(13.0 * x @ rough.T).sum(axis=1)

    start = rng.normal(size=(20, 2))
    found, values = minimise(merit, start, np.full(2, 0.1))
    assert np.all(values <= merit(start))
    np.testing.assert_array_equal(values, merit(found))
