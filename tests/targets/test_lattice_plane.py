"""Homographies from pixels to places, of all points or of those that agree."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from targets.rendering import pose_view, project

from handeye_cli.targets.lattice_plane import fitted_plane, plane_through

ASTRAY = 0.3


def seen_lattice(rng, noise, tilt=50):
    """Places 6 x 5 somewhere on a lattice, and their pixels in a tilted view."""
    places = np.argwhere(np.ones((6, 5), dtype=bool)) + rng.integers(-9, 9, 2)
    H = pose_view((5, 4), distance=11, tilt=tilt, about=rng.uniform(0, 360))
    pixels = project(H, places - places.min(axis=0))
    return pixels + rng.normal(0.0, noise, pixels.shape), places


@pytest.mark.parametrize("seed", range(3))
def test_a_plane_without_noise_is_found_again(seed):
    pixels, places = seen_lattice(np.random.default_rng(seed), 0.0)
    plane = plane_through(pixels, places)
    np.testing.assert_allclose(project(plane, pixels), places, atol=1e-9)
    # scaled so that the points' depths are about 1
    assert plane[2] @ [*pixels.mean(axis=0), 1.0] == pytest.approx(1.0)


@pytest.mark.parametrize("seed", range(3))
def test_a_plane_fits_as_well_as_that_of_opencv(seed):
    pixels, places = seen_lattice(np.random.default_rng(seed), 0.5)
    other, _ = cv2.findHomography(pixels, places.astype(np.float64))
    misses = [project(H, pixels) - places for H in (plane_through(pixels, places), other)]
    here, best = (np.sqrt(np.mean(miss**2)) for miss in misses)
    assert here < 1.02 * best
    assert best < 0.03


def test_few_points_and_places_on_a_line_have_no_plane():
    rng = np.random.default_rng(4)
    pixels, places = seen_lattice(rng, 0.2)
    assert plane_through(pixels[:3], places[:3]) is None
    line = rng.integers(-4, 4, 2) + np.outer(np.arange(6), [3, 2])
    assert plane_through(pixels[:6], line) is None
    for few in (pixels[:3], places[:3]), (pixels[:6], line):
        plane, fitting = fitted_plane(*few, ASTRAY)
        assert plane is None
        assert fitting.tolist() == [False] * len(few[0])


def test_points_that_are_astray_do_not_count():
    rng = np.random.default_rng(5)
    pixels, places = seen_lattice(rng, 0.3)
    pitch = np.linalg.norm(np.diff(pixels, axis=0), axis=1).min()
    astray = np.array([3, 11, 20])
    pixels[astray] += 1.2 * pitch
    plane, fitting = fitted_plane(pixels, places, ASTRAY)
    assert np.flatnonzero(~fitting).tolist() == astray.tolist()
    off = np.linalg.norm(project(plane, pixels) - places, axis=1)
    assert off[fitting].max() < 0.1
    without, all_fit = fitted_plane(pixels[fitting], places[fitting], ASTRAY)
    assert np.all(all_fit)
    np.testing.assert_allclose(
        project(without, pixels[fitting]), project(plane, pixels[fitting]), atol=0.03
    )
