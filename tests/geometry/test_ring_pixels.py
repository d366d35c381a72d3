"""Pixels along outlines against a mask of the whole image."""

from __future__ import annotations

import numpy as np
import pytest

from handeye_cli.geometry.ring_pixels import Padding, ring_pixels

SIZE = (120, 150)


def ellipse(centre, half_axes, turn, points=16):
    angle = 2 * np.pi * np.arange(points) / points
    a, b = half_axes
    x, y = a * np.cos(angle), b * np.sin(angle)
    c, s = np.cos(turn), np.sin(turn)
    return np.stack([c * x - s * y, s * x + c * y], axis=-1) + centre


def distances(centre, half_axes, turn):
    """Distance of every pixel of the image to an ellipse, by brute force."""
    ring = ellipse(centre, half_axes, turn, points=2000)
    v, u = np.mgrid[: SIZE[0], : SIZE[1]]
    pixels = np.stack([u, v], axis=-1).reshape(-1, 1, 2)
    return np.sqrt(np.min(np.sum((pixels - ring) ** 2, axis=-1), axis=1)).reshape(SIZE)


SHAPES = [
    ((40.3, 50.8), (20.0, 20.0), 0.0),
    ((90.7, 60.2), (24.0, 13.0), 0.7),
    ((60.0, 90.0), (9.0, 5.5), 2.0),
    ((2.0, 60.0), (18.0, 15.0), 0.4),
    ((140.0, 116.0), (16.0, 12.0), -0.5),
]


def selected(rings, band, every=1):
    column, row, count = ring_pixels(rings, SIZE, band, every=every)
    return np.split(np.stack([column, row], axis=1), np.cumsum(count)[:-1])


@pytest.mark.parametrize("band", [1.6, 3.0])
def test_the_band_is_taken_and_little_else(band):
    rings = np.array([ellipse(*shape) for shape in SHAPES])
    for shape, pixels in zip(SHAPES, selected(rings, band), strict=True):
        apart = distances(*shape)
        mask = np.zeros(SIZE, dtype=bool)
        mask[pixels[:, 1], pixels[:, 0]] = True
        assert mask.sum() == len(pixels), "a pixel was taken twice"
        # an ellipse's parallel curve is not quite an ellipse
        assert np.all(mask[apart < band - 0.35])
        assert np.all(apart[mask] < band + 0.5)


def test_one_outline_outside_of_the_image_has_no_pixels():
    rings = np.array([ellipse(*SHAPES[0]), ellipse((-80.0, 40.0), (9.0, 9.0), 0.0)])
    inside, outside = selected(rings, 2.0)
    assert len(inside) > 100
    assert len(outside) == 0


def test_every_third_pixel():
    rings = np.array([ellipse(*shape) for shape in SHAPES[:3]])
    whole = np.concatenate(selected(rings, 3.0))
    column, row, count = ring_pixels(rings, SIZE, 3.0, every=3)
    np.testing.assert_array_equal(np.stack([column, row], axis=1), whole[::3])
    assert count.sum() == len(column)
    for part, shape in zip(selected(rings, 3.0, every=3), SHAPES, strict=False):
        assert np.all(np.linalg.norm(part - np.array(shape[0]), axis=1) < max(shape[1]) + 4.0)


def test_padding_repeats_the_first_value_of_its_row():
    count = np.array([2, 0, 3])
    padding = Padding(count)
    np.testing.assert_array_equal(padding.weight, [[1, 1, 0], [0, 0, 0], [1, 1, 1]])
    rows = padding.rows(np.array([1, 2, 3, 4, 5], dtype=np.float32))
    np.testing.assert_array_equal(rows[[0, 2]], [[1, 2, 1], [3, 4, 5]])
