"""Slopes of a light that is known, from noisy levels of it."""

from __future__ import annotations

import numpy as np
import pytest

from handeye_cli.geometry.light_slopes import Light, course_of_light, even_course

GRID = 24.0 * np.stack(np.meshgrid(np.arange(6), np.arange(6)), axis=-1).reshape(-1, 2)
BETWEEN = 24.0 * (0.5 + np.stack(np.meshgrid(np.arange(5), np.arange(5)), axis=-1).reshape(-1, 2))
CORNER = np.array([150.0, 90.0])
PLACES, MARKS = CORNER + np.concatenate([GRID, BETWEEN]), CORNER + GRID
FITTED = np.arange(len(PLACES)) < len(GRID)
SIGMA = 0.25


def slope(light, at):
    step = 1e-3 * np.eye(2)
    return np.stack([(light(at + each) - light(at - each)) / 2e-3 for each in step], axis=-1)


def noisy(light, rng, offset=0.0):
    level = light(PLACES) + SIGMA * rng.normal(size=len(PLACES)) + offset * FITTED
    return Light(PLACES, level, np.full(len(PLACES), SIGMA**2), FITTED)


def even(at):
    return 180.0 + 0.12 * (at[..., 0] - 200.0) - 0.05 * (at[..., 1] - 150.0)


def bowed(at):
    return even(at) - 2e-3 * (at[..., 0] - 210.0) ** 2 + 1e-3 * at[..., 0] * at[..., 1]


def shadow(at, width=30.0):
    side = 0.8 * (at[..., 0] - 210.0) + 0.6 * (at[..., 1] - 150.0)
    return even(at) * (1.0 - 0.4 / (1.0 + np.exp(-1.7 * side / width)))


@pytest.mark.parametrize("light", [even, bowed])
def test_an_even_course_is_known_far_better_than_a_single_slope(light):
    rng = np.random.default_rng(1)
    pulls, spreads = [], []
    for _ in range(40):
        course = course_of_light(noisy(light, rng), MARKS)
        if course.mean.shape[1] == 2:
            pulls.append((course.mean - slope(light, MARKS)) ** 2 / course.variance)
            spreads.append(np.sqrt(course.variance))
    assert len(pulls) > 30
    # levels 24 px apart would give 0.015 per pixel each
    assert np.mean(spreads) < 0.006
    # the squares are no larger than foretold, and not much smaller
    assert 0.3 < np.mean(pulls) < 1.35


def test_what_fits_have_in_common_does_no_harm():
    rng = np.random.default_rng(2)
    course = course_of_light(noisy(even, rng, offset=2.0), MARKS)
    assert course.mean.shape[1] == 2
    assert np.abs(course.mean - slope(even, MARKS)).max() < 0.02


@pytest.mark.parametrize("width", [40.0, 20.0])
def test_a_shadow_is_followed_and_the_doubt_is_honest(width):
    rng = np.random.default_rng(int(width))
    pulls = []
    for _ in range(10):
        course = course_of_light(noisy(lambda at: shadow(at, width), rng), MARKS)
        assert course.mean.shape[1] == 5
        error = course.mean[:, :2] - slope(lambda at: shadow(at, width), MARKS)
        pulls.append(error**2 / course.variance[:, :2])
    assert 0.1 < np.mean(pulls) < 4.0


def test_units_of_length_do_not_matter():
    rng = np.random.default_rng(3)
    light = noisy(shadow, rng)
    here = course_of_light(light, MARKS)
    scaled = Light(light.places / 7.0, light.level, light.variance, light.fitted)
    there = course_of_light(scaled, MARKS / 7.0)
    np.testing.assert_allclose(there.mean[:, :2], 7.0 * here.mean[:, :2], rtol=1e-3)
    np.testing.assert_allclose(there.mean[:, 2:], 49.0 * here.mean[:, 2:], rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(there.variance[:, :2], 49.0 * here.variance[:, :2], rtol=1e-3)


@pytest.mark.parametrize("count", [0, 1])
def test_light_that_is_hardly_known_is_taken_to_be_even(count):
    light = Light(np.ones((count, 2)), np.ones(count), np.ones(count), np.ones(count, dtype=bool))
    course = course_of_light(light, np.arange(6.0).reshape(3, 2))
    assert not course.bent
    np.testing.assert_array_equal(course.mean, np.zeros((3, 2)))
    assert np.all(course.variance > 0.0)


def test_light_is_even_or_bent_by_a_shadow():
    def shaded(at):
        return 150.0 - 60.0 * (at[..., 0] > 200.0)

    flat = noisy(lambda at: 100.0 + 0.1 * at[..., 0], np.random.default_rng(5))
    np.testing.assert_array_equal(even_course(flat, MARKS).mean, course_of_light(flat, MARKS).mean)
    dark = noisy(shaded, np.random.default_rng(6))
    assert even_course(dark, MARKS) is None
    assert course_of_light(dark, MARKS).bent
