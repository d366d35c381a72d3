"""Pixels along outlines against a mask of the whole image."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import KDTree

from handeye_cli.geometry.ring_pixels import Ellipses, ring_pixels

SIZE = (120, 150)


def ellipse(centre, half_axes, turn, points=16):
    angle = 2 * np.pi * np.arange(points) / points
    a, b = half_axes
    x, y = a * np.cos(angle), b * np.sin(angle)
    c, s = np.cos(turn), np.sin(turn)
    return np.stack([c * x - s * y, s * x + c * y], axis=-1) + centre


def distances(centre, half_axes, turn):
    """Distance of every pixel of the image to the nearest of many points of an ellipse."""
    ring = ellipse(centre, half_axes, turn, points=2000)
    v, u = np.mgrid[: SIZE[0], : SIZE[1]]
    return KDTree(ring).query(np.stack([u, v], axis=-1))[0]


SHAPES = [
    ((40.3, 50.8), (20.0, 20.0), 0.0),
    ((90.7, 60.2), (24.0, 13.0), 0.7),
    ((60.0, 90.0), (9.0, 5.5), 2.0),
    ((2.0, 60.0), (18.0, 15.0), 0.4),
    ((140.0, 116.0), (16.0, 12.0), -0.5),
]


def ellipses(shapes):
    """The ellipses, from whole pixels near them that are not the nearest ones."""
    centre = np.array([centre for centre, _, _ in shapes])
    axes = np.array([half_axes for _, half_axes, _ in shapes])
    turn = np.array([turn for _, _, turn in shapes])
    c, s = np.cos(turn), np.sin(turn)
    M = np.array([[c, -s], [s, c]]).transpose(2, 0, 1) * axes[:, None]
    square = M @ M.transpose(0, 2, 1)
    origin = np.rint(centre) + np.array([1.0, -2.0])
    elements = np.stack([square[:, 0, 0], square[:, 0, 1], square[:, 1, 1]])
    return Ellipses.of(centre - origin, elements), origin


def selected(shapes, band):
    found, origin = ellipses(shapes)
    column, row, weight = ring_pixels(found, origin, SIZE, band)
    pixels = np.stack([column, row], axis=-1) + origin[:, None]
    return [each[held > 0].astype(int) for each, held in zip(pixels, weight, strict=True)]


def test_half_axes():
    found, _ = ellipses(SHAPES)
    np.testing.assert_allclose(found.half_axes.T, [axes for _, axes, _ in SHAPES])


def test_grown_ellipses_keep_their_directions():
    grown = [(centre, (a + 2.5, b + 2.5), turn) for centre, (a, b), turn in SHAPES]
    found, _ = ellipses(SHAPES)
    expected, _ = ellipses(grown)
    by = np.full(len(SHAPES), 2.5)
    np.testing.assert_allclose(found.grown(by), expected.square, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(found.grown(np.stack([by, -by]))[:, 0], expected.square, atol=1e-9)


@pytest.mark.parametrize("band", [1.6, 3.0])
def test_the_band_is_taken_and_little_else(band):
    for shape, pixels in zip(SHAPES, selected(SHAPES, band), strict=True):
        apart = distances(*shape)
        mask = np.zeros(SIZE, dtype=bool)
        mask[pixels[:, 1], pixels[:, 0]] = True
        assert mask.sum() == len(pixels), "a pixel was taken twice"
        # an ellipse's parallel curve is not quite an ellipse
        assert np.all(mask[apart < band - 0.3])
        assert np.all(apart[mask] < band + 0.3)


def test_one_outline_outside_of_the_image_has_no_pixels():
    inside, above, aside = selected(
        [SHAPES[0], ((60.0, -80.0), (9.0, 9.0), 0.0), ((-80.0, 40.0), (9.0, 9.0), 0.0)], 2.0
    )
    assert len(inside) > 100
    assert len(above) == len(aside) == 0


def test_what_fills_up_a_row_is_near():
    found, origin = ellipses(SHAPES)
    column, row, weight = ring_pixels(found, origin, SIZE, 2.0)
    for k, shape in enumerate(SHAPES):
        spare = np.stack([column[k], row[k]], axis=-1)[weight[k] == 0] + origin[k]
        apart = np.linalg.norm(spare - np.array(shape[0]), axis=1)
        assert np.all(apart < max(shape[1]) + 3.0)


def test_all_inside_is_selected_on_demand():
    found, origin = ellipses(SHAPES)
    column, row, weight = ring_pixels(found, origin, SIZE, 2.0, hollow=False)
    for k, (centre, half_axes, turn) in enumerate(SHAPES):
        pixels = (np.stack([column[k], row[k]], axis=-1) + origin[k])[weight[k] > 0].astype(int)
        mask = np.zeros(SIZE, dtype=int)
        np.add.at(mask, (pixels[:, 1], pixels[:, 0]), 1)
        v, u = np.mgrid[: SIZE[0], : SIZE[1]]
        x, y = u - centre[0], v - centre[1]
        c, s = np.cos(turn), np.sin(turn)
        inside = ((c * x + s * y) / half_axes[0]) ** 2 + ((c * y - s * x) / half_axes[1]) ** 2 < 1.0
        near = distances(centre, half_axes, turn) < 2.0
        assert mask.max() == 1
        assert np.all(mask[inside] == 1)
        assert np.sum((mask == 1) != (inside | near)) <= 6
