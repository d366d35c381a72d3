"""The paper between discs, in pictures that are whole numbers of pixels."""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry.disc_paper import paper_between

COLUMN, ROW = np.meshgrid(np.arange(4), np.arange(3))
DISCS = np.column_stack([COLUMN.ravel(), ROW.ravel(), np.full(12, 0.25)])
PITCH = 24.0


def to_pixel(plate):
    return PITCH * np.asarray(plate) + 20.0


def picture():
    """Light that rises to the right, the same in each column."""
    return np.tile(np.linspace(60.0, 240.0, 120).astype(np.uint8), (90, 1))


def test_patches_lie_in_the_middle_of_each_four_discs():
    found = paper_between(picture(), DISCS, to_pixel, PITCH, 2.0)
    expected = [to_pixel([x + 0.5, y + 0.5]) for y in range(2) for x in range(3)]
    order = np.lexsort(found.places.T)
    np.testing.assert_allclose(found.places[order], expected)
    column = found.places[:, 0].astype(int)
    # a level rises by less than two from column to column
    np.testing.assert_allclose(found.level, picture()[0, column], atol=1.0)
    assert found.count in {(2 * reach + 1) ** 2 for reach in range(1, 6)}


def test_patches_with_a_black_or_a_white_pixel_tell_nothing():
    grey = picture()
    whole = paper_between(grey, DISCS, to_pixel, PITCH, 2.0)
    for k, level in ((0, 255), (4, 0)):
        u, v = whole.places[k].astype(int)
        grey[v + 1, u - 1] = level
    left = paper_between(grey, DISCS, to_pixel, PITCH, 2.0)
    np.testing.assert_allclose(left.places, np.delete(whole.places, [0, 4], axis=0))
    np.testing.assert_allclose(left.level, np.delete(whole.level, [0, 4]))


def test_discs_that_nearly_touch_leave_no_paper():
    crowded = DISCS * [1.0, 1.0, 1.95]
    found = paper_between(picture(), crowded, to_pixel, PITCH, 6.0)
    assert found.places.shape == (0, 2)
    assert len(found.level) == 0
