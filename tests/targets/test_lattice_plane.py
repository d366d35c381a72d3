"""Homographies from pixels to places, of all points or of those that agree."""

from __future__ import annotations

import numpy as np
import pytest
from targets.rendering import pose_view, project

from handeye_cli.targets.lattice_plane import agreed_plane, nearest_plane
from handeye_cli.targets.linear_homography import linear_homography

ASTRAY = 0.3


def seen_lattice(rng, noise):
    """Places 6 x 5 somewhere on a lattice, and their pixels in a tilted view."""
    places = np.argwhere(np.ones((6, 5), dtype=bool)) + rng.integers(-9, 9, 2)
    H = pose_view((5, 4), distance=11, tilt=50, about=rng.uniform(0, 360))
    pixels = project(H, places - places.min(axis=0))
    return pixels + rng.normal(0.0, noise, pixels.shape), places


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("fit", [linear_homography, nearest_plane])
def test_a_plane_without_noise_is_found_again(fit, seed):
    pixels, places = seen_lattice(np.random.default_rng(seed), 0.0)
    # the library's fit is good to single precision
    np.testing.assert_allclose(project(fit(pixels, places), pixels), places, atol=1e-5)


@pytest.mark.parametrize("seed", range(3))
def test_a_linear_homography_misses_little_more_than_the_nearest_one(seed):
    pixels, places = seen_lattice(np.random.default_rng(seed), 0.5)
    misses = [
        project(fit(pixels, places), pixels) - places for fit in (linear_homography, nearest_plane)
    ]
    here, least = (np.sqrt(np.mean(miss**2)) for miss in misses)
    assert (1 - 1e-6) * least < here < 1.02 * least
    assert least < 0.03


def test_few_points_and_places_on_a_line_have_no_plane():
    rng = np.random.default_rng(4)
    pixels, places = seen_lattice(rng, 0.2)
    line = rng.integers(-4, 4, 2) + np.outer(np.arange(6), [3, 2])
    for few in (pixels[:3], places[:3]), (pixels[:6], line):
        assert linear_homography(*few) is None
        plane, fitting = agreed_plane(*few, ASTRAY)
        assert plane is None
        assert fitting.tolist() == [False] * len(few[0])


def test_all_points_of_a_plate_count():
    pixels, places = seen_lattice(np.random.default_rng(6), 0.5)
    plane, fitting = agreed_plane(pixels, places, ASTRAY)
    np.testing.assert_array_equal(plane, linear_homography(pixels, places))
    assert np.all(fitting)


def test_points_that_are_astray_do_not_count():
    pixels, places = seen_lattice(np.random.default_rng(5), 0.3)
    pitch = np.linalg.norm(np.diff(pixels, axis=0), axis=1).min()
    astray = np.array([3, 11, 20])
    pixels[astray] += 1.2 * pitch
    plane, fitting = agreed_plane(pixels, places, ASTRAY)
    assert np.flatnonzero(~fitting).tolist() == astray.tolist()
    off = np.linalg.norm(project(plane, pixels) - places, axis=1)
    assert off[fitting].max() < 0.1
