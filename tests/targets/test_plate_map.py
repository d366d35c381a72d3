"""Maps from a target's plane to pixels, from points seen through a camera with distortion."""

from __future__ import annotations

import numpy as np
import pytest

from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.records import Camera
from handeye_cli.targets.plate_map import plate_map

CAMERA = Camera(1600, 1200, 1376.0, 1380.0, 797.0, 602.0, (-0.2, 0.05, 0.0005, -0.0003, 0.0))
CLOSE = 1e-5
"""Pixels that a map may be off, as directions are found step by step."""


def plane(columns, rows, pitch=0.005):
    row, column = np.divmod(np.arange(columns * rows), columns)
    return pitch * np.stack([column, row], axis=1).astype(float)


def seen(plate, tilt=0.6):
    R = rotations.exp(np.array([tilt, -0.3, 0.2]))
    pose = se3.from_parts(R, np.array([-0.01, -0.012, 0.09]))
    points = se3.transform_points(pose, np.pad(plate, ((0, 0), (0, 1))))
    return project(points, CAMERA.parameters, CAMERA.model)


@pytest.mark.parametrize("seed", range(3))
def test_a_camera_tells_where_points_between_the_given_ones_are(seed):
    plate = plane(6, 6)
    between = np.random.default_rng(seed).uniform(0.0, 0.025, (50, 2))
    to_pixel = plate_map(plate, seen(plate), CAMERA)
    np.testing.assert_allclose(to_pixel(between), seen(between), atol=CLOSE)
    np.testing.assert_array_equal(to_pixel(between.reshape(5, 10, 2))[2], to_pixel(between)[20:30])


def test_noise_of_the_points_is_averaged_over_them():
    plate, noise = plane(6, 6), 0.1
    rng = np.random.default_rng(7)
    errors = [
        plate_map(plate, seen(plate) + rng.normal(0.0, noise, (36, 2)), CAMERA)(plate) - seen(plate)
        for _ in range(200)
    ]
    # of 72 coordinates, the 8 numbers of a homography keep their share of the noise
    expected = noise * np.sqrt(8 / 72)
    # 200 draws with 8 degrees of freedom each: the RMS is good to 1 / sqrt(2 * 1600)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(expected, rel=4 / np.sqrt(3200))


def test_a_cubic_stands_for_the_distortion_of_an_unknown_camera():
    plate = plane(6, 6)
    between = np.random.default_rng(4).uniform(0.0, 0.025, (50, 2))
    bent = plate_map(plate, seen(plate), None)(between) - seen(between)
    few = plate[[0, 5, 30, 35]]
    plain = plate_map(few, seen(few), None)(between) - seen(between)
    # terms of the fourth order stay: the distortion is a few pixels
    assert np.abs(bent).max() < 0.05
    assert np.abs(plain).max() > 10 * np.abs(bent).max()


def test_a_target_seen_edge_on_still_has_a_map():
    plate = plane(3, 2)
    pixels = np.stack([100.0 + 1e4 * plate[:, 0], np.full(6, 50.0)], axis=1)
    assert np.all(np.isfinite(plate_map(plate, pixels, None)(plate)))


LENSES = {
    "plumb_bob": [(), (-0.2, 0.05, 0.0005, -0.0003), (-0.3, 0.12, 0.001, -0.002, -0.02)],
    "rational_polynomial": [
        (0.4, -0.2, 0.0004, 0.0002, 0.05, 0.6, -0.1, 0.02),
        (0.4, -0.2, 0.0004, 0.0002, 0.05, 0.6, -0.1, 0.02, 1e-3, -2e-4, -8e-4, 1e-4),
    ],
    "equidistant": [(0.02, -0.01, 0.003, -0.0005)],
}


@pytest.mark.parametrize(
    ("model", "distortion"), [(model, each) for model, some in LENSES.items() for each in some]
)
def test_the_map_is_that_of_the_lens(model, distortion):
    camera = Camera(1600, 1200, 1376.0, 1380.0, 797.0, 602.0, distortion, model)
    plate = plane(7, 5)
    pose = se3.from_parts(rotations.exp(np.array([0.5, -0.3, 0.2])), np.array([-0.02, -0.01, 0.06]))
    points = se3.transform_points(pose, np.pad(plate, ((0, 0), (0, 1))))
    pixels = project(points, camera.parameters, model)
    np.testing.assert_allclose(plate_map(plate, pixels, camera)(plate), pixels, atol=CLOSE)
    # in whatever order of memory the pixels come
    np.testing.assert_allclose(
        plate_map(plate, np.asfortranarray(pixels), camera)(plate), pixels, atol=CLOSE
    )


def test_a_lens_that_gives_pixels_no_direction_is_as_good_as_none():
    """This one shows nothing beyond 0.39 focal lengths; the plate is farther out."""
    folding = Camera(1600, 1200, 400.0, 400.0, 797.0, 602.0, (-1.0, 0.0, 0.0, 0.0))
    plate = plane(6, 6)
    pixels = seen(plate)
    assert np.max(np.abs(pixels - [797.0, 602.0])) > 0.39 * 400.0
    np.testing.assert_array_equal(
        plate_map(plate, pixels, folding)(plate), plate_map(plate, pixels, None)(plate)
    )
