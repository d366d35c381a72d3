"""Inverses of matrices whose unknowns have very different units."""

import numpy as np
import pytest

from handeye_cli.geometry.scaled_inverse import scaled_inverse, scaled_pseudo_inverse

UNITS = 10.0 ** np.array([-9.0, 0.0, 4.0, 8.0])


def informations(*batch):
    """Well-conditioned matrices in units that are not."""
    roots = np.random.default_rng(6).normal(size=(*batch, 4, 9))
    plain = roots @ np.swapaxes(roots, -1, -2)
    return plain, plain * UNITS[:, None] * UNITS


@pytest.mark.parametrize("inverse", [scaled_inverse, scaled_pseudo_inverse])
@pytest.mark.parametrize("batch", [(), (5,), (2, 3)])
def test_the_units_do_not_matter(inverse, batch):
    plain, strange = informations(*batch)
    expected = np.linalg.inv(plain) / UNITS[:, None] / UNITS
    found = inverse(strange)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_a_direction_that_nothing_determines_is_left_at_zero():
    rows = np.random.default_rng(7).normal(size=(9, 4))
    rows[:, 2] = rows[:, 0]
    information = rows.T @ rows
    # two equal unknowns share what is known of their sum
    expected = np.linalg.pinv(information, hermitian=True)
    np.testing.assert_allclose(scaled_pseudo_inverse(information), expected, atol=1e-12)
    assert scaled_pseudo_inverse(np.zeros((3, 3))).tolist() == np.zeros((3, 3)).tolist()


def test_a_direction_that_is_hardly_determined_is_left_out_on_demand():
    weak = np.array([[1.0, 1.0 - 1e-6], [1.0 - 1e-6, 1.0]])
    assert np.max(scaled_pseudo_inverse(weak)) > 1e5
    np.testing.assert_allclose(scaled_pseudo_inverse(weak, 1e-4), 0.25 * np.ones((2, 2)), rtol=1e-5)


def test_a_negative_diagonal_is_rounding_and_not_information():
    """As of a noise level at its floor, where large sums cancel."""
    cancelled = np.array([[2.8e14, -1.5e18], [-4.7e17, -1.3e28]])
    found = scaled_pseudo_inverse(np.stack([cancelled, np.diag([4.0, 2.0])]))
    np.testing.assert_allclose(found[0], np.diag([1.0 / 2.8e14, 0.0]), rtol=1e-12)
    np.testing.assert_allclose(found[1], np.diag([0.25, 0.5]), rtol=1e-12)
