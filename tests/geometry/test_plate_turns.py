"""Motions of plates that look the same after them, against turns written down by hand."""

import numpy as np
from pictures import quarter_turns

from handeye_cli.geometry import se3
from handeye_cli.geometry.plate_turns import plate_turns

SIDE = 4
POINTS = np.array(
    [[0.01 * column, 0.01 * row, 0.0] for row in range(SIDE) for column in range(SIDE)]
)


def test_every_point_comes_to_the_place_of_its_partner():
    turns = quarter_turns(SIDE)
    for motion, turn in zip(plate_turns(POINTS, turns), turns, strict=True):
        np.testing.assert_allclose(se3.transform_points(motion, POINTS), POINTS[turn], atol=1e-15)


def test_they_are_the_quarter_turns_about_the_middle_of_the_plate():
    middle = 0.01 * (SIDE - 1) / 2.0
    angles = np.pi / 2.0 * np.arange(4)
    expected = {
        (round(np.cos(a)), round(np.sin(a)), round(middle * (1 - np.cos(a) + np.sin(a)), 9))
        for a in angles
    }
    found = plate_turns(POINTS, quarter_turns(SIDE))
    assert {(round(m[0, 0]), round(m[1, 0]), round(m[0, 3], 9)) for m in found} == expected
    np.testing.assert_allclose(found[:, 2], np.tile([0.0, 0.0, 1.0, 0.0], (4, 1)), atol=1e-15)
