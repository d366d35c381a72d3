"""The parts that drawings of targets are put together from."""

import numpy as np
import pytest

from handeye_cli.targets.drawing import Drawing, checkers, dark_cells, outline_around


def test_dark_cells_are_merged_along_rows_only():
    dark = np.array([[1, 1, 0, 1], [0, 0, 0, 0], [0, 1, 1, 1]], dtype=bool)
    expected = [[0, 0, 2, 1], [3, 0, 4, 1], [1, 2, 4, 3]]
    np.testing.assert_allclose(dark_cells(dark, 0.5), 0.5 * np.array(expected))


def test_a_light_code_has_no_rectangles():
    assert dark_cells(np.zeros((3, 4), dtype=bool), 1.0).shape == (0, 4)


def test_runs_cover_what_is_dark_and_nothing_else():
    dark = np.random.default_rng(1).random((20, 30)) < 0.5
    painted = np.zeros(dark.shape, dtype=int)
    for x0, y0, x1, y1 in dark_cells(dark, 1.0).astype(int):
        painted[y0:y1, x0:x1] += 1
    np.testing.assert_array_equal(painted, dark)


@pytest.mark.parametrize("dark_first", [True, False])
def test_checkers_alternate(dark_first):
    squares = checkers(3, 2, 2.0, dark_first=dark_first)
    places = {(x // 2, y // 2) for x, y in squares[:, :2]}
    assert places == {(x, y) for x in range(3) for y in range(2) if (x + y) % 2 != dark_first}
    np.testing.assert_allclose(squares[:, 2:] - squares[:, :2], 2.0)


def test_an_outline_keeps_its_margin_around_points_and_rectangles():
    points = np.array([[1.0, 5.0], [4.0, 2.0]])
    np.testing.assert_allclose(outline_around(points, 0.5), [[0.5, 1.5], [4.5, 5.5]])
    rectangles = np.array([[0.0, 1.0, 2.0, 3.0], [5.0, -1.0, 6.0, 0.0]])
    np.testing.assert_allclose(outline_around(rectangles, 1.0), [[-1.0, -2.0], [7.0, 4.0]])


def test_an_empty_drawing_is_endless_paper():
    nothing = Drawing()
    assert nothing.endless
    assert len(nothing.discs) == len(nothing.rectangles) == 0
    assert not Drawing(outline=np.array([[0.0, 0.0], [1.0, 1.0]])).endless
