"""Sides of an image beyond which parts of a target lie."""

import numpy as np
import pytest

from handeye_cli.targets.image_sides import leaving, named

SIZE = (100, 200)


def boxes(*middles, radius=5.0):
    middles = np.reshape(middles, (-1, 2))
    return np.stack([middles - radius, middles + radius], axis=1)


@pytest.mark.parametrize(
    ("middles", "count", "sides"),
    [
        ([(50, 50), (5, 94), (194, 5)], 0, []),
        ([(4.9, 50), (50, 50)], 1, ["left"]),
        ([(50, 4), (50, 95), (60, 99)], 3, ["top", "bottom"]),
        ([(-50, -50)], 1, ["left", "top"]),
        ([(195, 50), (50, 4), (4, 50)], 3, ["left", "top", "right"]),
    ],
)
def test_what_reaches_beyond_a_side_is_counted_once(middles, count, sides):
    assert leaving(boxes(*middles), SIZE) == (count, sides)


def test_a_margin_counts_as_outside():
    assert leaving(boxes((5.5, 50)), SIZE) == (0, [])
    assert leaving(boxes((5.5, 50)), SIZE, margin=1.0) == (1, ["left"])


def test_nothing_leaves_nowhere():
    assert leaving(np.zeros((0, 2, 2)), SIZE) == (0, [])


@pytest.mark.parametrize(
    ("sides", "words"),
    [
        (["top"], "on the top"),
        (["left", "top"], "on the left and top"),
        (["left", "top", "right"], "on the left, top and right"),
        (["left", "top", "right", "bottom"], "on all sides"),
    ],
)
def test_sides_are_named(sides, words):
    assert named(sides) == words
