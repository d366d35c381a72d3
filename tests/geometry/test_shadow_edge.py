"""Edges of shadows: their derivatives, and the edge that levels of the light show."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

from handeye_cli.geometry.light_slopes import Light
from handeye_cli.geometry.shadow_edge import PARAMETERS, ShadowEdge, edge_in

MIDDLE, PITCH = np.array([310.0, 250.0]), 30.0
COLUMN, ROW = np.meshgrid(np.arange(-3, 4), np.arange(-3, 4))
PLACES = MIDDLE + PITCH * np.stack([COLUMN.ravel(), ROW.ravel()], axis=1)


def edge(direction=0.7, offset=0.2, width=0.6, depth=0.4, moments=(0.0, 0.0)):
    return ShadowEdge(MIDDLE, PITCH, np.array([direction, offset, np.log(width), depth, *moments]))


def light(level, noise, fitted=False):
    count = len(level)
    return Light(PLACES, level, np.full(count, noise**2), np.full(count, fitted))


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


@pytest.mark.parametrize("direction", [0.3, 1.9, 3.6, 5.5])
@pytest.mark.parametrize("width", [0.5, 1.2])
def test_the_edge_of_a_shadow_is_found_in_the_levels(direction, width):
    rng = np.random.default_rng([3, int(10 * direction)])
    true = edge(direction, 0.4, width, 0.45)
    x, y = (PLACES - MIDDLE).T / PITCH
    level = (180 + 4 * x - 6 * y) * true.left(*PLACES.T) + rng.normal(0.0, 0.2, len(PLACES))
    found = edge_in(light(level, 0.2), PITCH)
    assert found is not None
    assert found.sharp is (width < 1.0)
    turn = np.angle(np.exp(1j * (found.parameters[0] - direction)))
    assert abs(turn) < 0.03
    # the others are known within some hundredths, as the light beside the edge may be uneven
    np.testing.assert_allclose(found.parameters[1:4], true.parameters[1:4], atol=0.12)
    np.testing.assert_allclose(found.left(*PLACES.T), true.left(*PLACES.T), atol=0.02)


@pytest.mark.parametrize("seed", range(6))
def test_an_edge_much_sharper_than_the_pitch_is_found_in_the_levels(seed):
    """Levels have it between two rows; a soft edge elsewhere must not be taken for it."""
    rng = np.random.default_rng([5, seed])
    direction, offset = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(-2.2, 2.2)
    true = edge(direction, offset, 0.03, 0.45)
    x, y = (PLACES - MIDDLE).T / PITCH
    level = (180 + 4 * x - 6 * y) * true.left(*PLACES.T) + rng.normal(0.0, 0.3, len(PLACES))
    found = edge_in(light(level, 0.3), PITCH)
    assert found is not None
    np.testing.assert_allclose(found.left(*PLACES.T), true.left(*PLACES.T), atol=0.06)


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


@pytest.mark.parametrize("bend", [0.0, 0.1])
def test_a_plane_needs_no_shadow(bend):
    """Nor does light that is uneven by a fraction of a percent."""
    rng = np.random.default_rng(4)
    x, y = (PLACES - MIDDLE).T / PITCH
    level = 180 + 9 * x - 6 * y + bend * x * x + rng.normal(0.0, 0.3, len(PLACES))
    assert edge_in(light(level, 0.3), PITCH) is None


def test_a_few_levels_show_no_edge():
    few = light(180 * edge().left(*PLACES.T), 0.2)
    some = Light(few.places[:11], few.level[:11], few.variance[:11], few.fitted[:11])
    assert edge_in(few, PITCH) is not None
    assert edge_in(some, PITCH) is None


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
