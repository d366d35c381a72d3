import numpy as np
import pytest
from targets.rendering import chessboard, pose_view, project, render

from handeye_cli import targets


def board_of(shape):
    return targets.build(targets.parse(f"chessboard:{shape}:1mm"))


def picture(board, *, roll, tilt=20.0, distance=20.0, top_left_dark=True):
    H = pose_view((board.columns - 1, board.rows - 1), distance=distance, tilt=tilt, about=30,
                  roll=roll)  # fmt: skip
    colour = chessboard(board.columns, board.rows, 1.0, top_left_dark=top_left_dark)
    return render(colour, H, samples=6, noise=1.0), H


@pytest.mark.parametrize("tilt", [0, 30, 50])
@pytest.mark.parametrize("distance", [20, 26])
def test_corners_are_found_to_a_tenth_of_a_pixel(tilt, distance):
    board = board_of("9x6")
    image, H = picture(board, roll=8, tilt=tilt, distance=distance)
    seen = board.detect(image)
    error = np.abs(seen.pixels - project(H, board.points() * 1000))
    assert np.sqrt(np.mean(error**2)) < 0.1
    assert error.max() < 0.25


@pytest.mark.parametrize("shape", ["9x6", "6x9", "7x7", "6x6", "7x5"])
@pytest.mark.parametrize("roll", [0, 90, 180, 270])
def test_the_order_is_right_up_to_what_the_colours_leave_open(shape, roll):
    board = board_of(shape)
    image, H = picture(board, roll=roll + 5, distance=24)
    seen = board.detect(image)
    truth = project(H, board.points() * 1000)
    fits = [np.abs(seen.pixels - truth[turn]).max() for turn in board.turns()]
    assert min(fits) < 0.3
    starts = [truth[turn[0]].sum() for turn in board.turns()]
    assert np.argmin(fits) == np.argmin(starts)


@pytest.mark.parametrize(
    ("shape", "count"), [("9x6", 1), ("6x9", 1), ("7x5", 2), ("8x6", 2), ("7x7", 2), ("8x8", 4)]
)
def test_turns_are_those_that_keep_the_colours(shape, count):
    board = board_of(shape)
    turns = board.turns()
    assert len(turns) == count
    # seen by the colour at a distance: dark squares fall onto dark squares
    colour = chessboard(board.columns, board.rows, 1.0)
    corners = board.points()[:, :2] * 1000
    for turn in turns:
        right, down = (
            corners[turn[1]] - corners[turn[0]],
            (corners[turn[board.columns]] - corners[turn[0]]),
        )
        x, y = (corners[turn[0]] + (right + down) / 2).reshape(2, 1)
        assert colour(x, y) == colour(np.array([0.5]), np.array([0.5]))


def test_a_board_with_a_light_top_left_square_is_not_a_square_board_of_odd_size():
    # a quarter turn of 7x7 changes the colours, so every such board can be read as a dark one
    board = board_of("7x7")
    image, _ = picture(board, roll=5, top_left_dark=False)
    assert board.detect(image).reason is None
    # of 6x6 no turn does, so its picture is of another board
    board = board_of("6x6")
    image, _ = picture(board, roll=5, top_left_dark=False)
    assert "in no order of them is the square at the top left dark" in board.detect(image).reason


def test_a_board_that_is_cut_says_so():
    board = board_of("9x6")
    image, _ = picture(board, roll=0)
    image = image[:, 140:].copy()
    assert "the board leaves the image on the left" in board.detect(image).reason
