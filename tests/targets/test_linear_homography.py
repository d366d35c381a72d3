"""Homographies by the linear method."""

from __future__ import annotations

import numpy as np
import pytest
from targets.rendering import pose_view, project

from handeye_cli.targets.linear_homography import linear_homography

GRID = np.argwhere(np.ones((6, 5), dtype=bool)).astype(float)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_it_has_all_digits_and_a_depth_of_one(seed, unit):
    rng = np.random.default_rng(seed)
    H = pose_view((5, 4), distance=11, tilt=50, about=rng.uniform(0, 360))
    points = unit * (GRID + rng.uniform(-9, 9, 2))
    images = project(H, GRID)
    found = linear_homography(points, images)
    np.testing.assert_allclose(project(found, points), images, rtol=1e-9)
    assert found[2] @ [*points.mean(axis=0), 1.0] == pytest.approx(1.0)


def test_four_points_tell_it():
    rng = np.random.default_rng(5)
    points, images = GRID[[0, 4, 25, 29]], rng.uniform(0.0, 0.4, (4, 2)) + GRID[[0, 4, 25, 29]]
    found = linear_homography(points, images)
    np.testing.assert_allclose(project(found, points), images, atol=1e-9)
    assert linear_homography(points[:3], images[:3]) is None


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.3, -0.7), (0.0, 2.0)])
def test_points_on_a_line_tell_none(direction):
    line = np.array([4.2, -1.3]) + np.outer(np.random.default_rng(6).uniform(-3, 3, 8), direction)
    assert linear_homography(GRID[:8], line) is None
    assert linear_homography(line, GRID[:8]) is None
