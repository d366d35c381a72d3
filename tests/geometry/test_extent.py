"""The middle of the box around points."""

import numpy as np

from handeye_cli.geometry.extent import middle_of


def test_the_middle_is_that_of_the_box_and_not_of_the_points():
    points = np.array([[0.0, 1.0, -3.0], [1.0, 1.0, -3.0], [4.0, 2.0, 5.0]])
    np.testing.assert_array_equal(middle_of(points), [2.0, 1.5, 1.0])
    assert middle_of(np.array([[1, 2], [2, 2]])).tolist() == [1.5, 2.0]
