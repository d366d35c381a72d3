"""The edge of a shadow that levels of the light show."""

from __future__ import annotations

import numpy as np
import pytest
from geometry.shadows import MIDDLE, PITCH, PLACES, edge

from handeye_cli.geometry.light_slopes import Light
from handeye_cli.geometry.shadow_search import edge_in


def light(level, noise, places=PLACES):
    count = len(level)
    return Light(places, level, np.full(count, noise**2), np.full(count, False))


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


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.6, 0.8)])
def test_levels_on_a_line_show_an_edge_across_it_or_none(direction):
    """Of a plane they tell the slope along the line alone."""
    line = MIDDLE + PITCH * np.linspace(-6.0, 6.0, 25)[:, None] * direction
    noise = np.random.default_rng(8).normal(0.0, 0.2, len(line))
    assert edge_in(light(180.0 + noise, 0.2, line), PITCH) is None
    true = edge(np.arctan2(direction[1], direction[0]), 1.0, 0.5, 0.4)
    found = edge_in(light(180.0 * true.left(*line.T) + noise, 0.2, line), PITCH)
    assert found is not None
    np.testing.assert_allclose(found.left(*line.T), true.left(*line.T), atol=0.03)
