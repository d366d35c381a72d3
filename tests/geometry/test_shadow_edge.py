"""Edges of shadows: how the light falls across them, and its derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from geometry.shadows import PLACES, edge
from scipy.special import ndtr

from handeye_cli.geometry.shadow_edge import PARAMETERS


def test_a_gaussian_edge():
    u, v = np.random.default_rng(1).uniform(200, 400, (2, 300))
    z = (np.cos(0.7) * (u - 310) + np.sin(0.7) * (v - 250) - 0.2 * 30) / (0.6 * 30)
    np.testing.assert_allclose(edge().left(u, v), 1 - 0.4 * ndtr(z), atol=1e-5)


def test_moments_are_those_of_the_edge():
    """The derivative across has the moments that a Gram-Charlier series gives it."""
    u = np.linspace(310 - 6 * 30, 310 + 6 * 30, 20001)
    moments = (0.04, -0.006)
    left = edge(0.0, 0.0, 1.0, 0.5, moments).left(u, np.full_like(u, 250.0)).astype(float)
    across = (u[1:] + u[:-1]) / 60 - 310 / 30
    density = -np.diff(left) / 0.5
    np.testing.assert_allclose(density.sum(), 1.0, atol=1e-4)
    np.testing.assert_allclose(density @ across**2, 1.0, atol=2e-3)
    np.testing.assert_allclose(density @ across**4, 3.0 + 24 * moments[0], atol=0.02)
    expected = 15.0 + 15 * 24 * moments[0] + 720 * moments[1]
    np.testing.assert_allclose(density @ across**6, expected, atol=0.3)


def test_derivatives():
    here = edge(moments=(0.03, -0.01))
    u, v = np.random.default_rng(2).uniform(220, 400, (2, 300))
    slopes = np.empty((PARAMETERS, 300), np.float32)
    np.testing.assert_array_equal(here.with_slopes(u, v, slopes), here.left(u, v))
    simple = np.empty((4, 300), np.float32)
    np.testing.assert_array_equal(here.with_slopes(u, v, simple), here.left(u, v))
    np.testing.assert_array_equal(simple, slopes[:4])
    for k in range(PARAMETERS):
        step = 0.01 * np.eye(PARAMETERS)[k]
        expected = (here.moved(step).left(u, v) - here.moved(-step).left(u, v)) / 0.02
        np.testing.assert_allclose(slopes[k], expected, atol=4e-3)


def test_steps_and_parameters_have_limits():
    here = edge(depth=0.9)
    for _ in range(100):
        here = here.moved(np.array([0.0, 0.0, 9.0, 9.0, 9.0, -9.0]))
    assert here.parameters[2:] == pytest.approx([1.5, 0.95, 0.1, -0.1])


def test_an_edge_rests_when_it_moves_by_a_small_share_of_its_width():
    here = edge(width=0.1)
    assert here.rests_since(here)
    assert edge(width=0.1, offset=0.21).rests_since(here)
    assert not edge(width=0.1, offset=0.22).rests_since(here)
    assert edge(width=1.0, offset=0.3).rests_since(edge(width=1.0))
    assert not edge(width=0.1, direction=0.71).rests_since(here)
    assert not edge(width=0.12).rests_since(here)


def test_an_edge_may_be_too_sharp_to_begin_with():
    assert np.exp(edge(width=0.01).softened.parameters[2]) == pytest.approx(0.15)
    np.testing.assert_array_equal(edge().softened.parameters, edge().parameters)


def test_an_edge_beside_the_plate_is_none_on_it():
    assert edge(0.0, 2.9).between(PLACES)
    assert not edge(0.0, 3.1).between(PLACES)
    assert not edge(0.0, -3.1).between(PLACES)
    # the corners of the plate are farther away than its sides
    assert edge(np.pi / 4, 3.1).between(PLACES)


def test_some_light_is_always_left():
    dark = edge(depth=0.95, moments=(-0.1, 0.1))
    u, v = np.random.default_rng(6).uniform(150, 470, (2, 2000))
    assert dark.left(u, v).min() == pytest.approx(0.02)
