import cv2
import numpy as np
import pytest
from targets.rendering import chessboard, pose_view, project, render

from handeye_cli import targets
from handeye_cli.targets.chessboard_finder import _goes_on


def board_of(shape):
    return targets.build(targets.parse(f"chessboard:{shape}:1mm"))


def picture(board, *, roll, tilt=20.0, distance=20.0, top_left_dark=True, samples=3):
    H = pose_view((board.columns - 1, board.rows - 1), distance=distance, tilt=tilt, about=30,
                  roll=roll)  # fmt: skip
    colour = chessboard(board.columns, board.rows, 1.0, top_left_dark=top_left_dark)
    return render(colour, H, samples=samples, noise=1.0), H


@pytest.mark.parametrize(("tilt", "distance"), [(0, 20), (30, 26), (50, 20), (50, 26)])
def test_corners_are_found_to_a_tenth_of_a_pixel(tilt, distance):
    board = board_of("9x6")
    image, H = picture(board, roll=8, tilt=tilt, distance=distance, samples=6)
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
    image, H = picture(board, roll=0)
    seen = int((project(H, board.points() * 1000)[:, 0] > 141).sum())
    reason = board.detect(image[:, 140:].copy()).reason
    assert reason.endswith("of 54 corners: the board leaves the image on the left")
    assert abs(int(reason.split()[0]) - seen) <= 1


@pytest.mark.parametrize("declared", ["10x7", "8x6", "9x5", "6x5"])
def test_another_board_is_named(declared):
    image, _ = picture(board_of("9x6"), roll=12)
    assert board_of(declared).detect(image).reason == (
        f"9x6 inner corners of a chessboard were found, not {declared}"
    )


@pytest.mark.parametrize("larger", ["10x6", "9x7"])
def test_a_larger_board_with_a_covered_corner_is_not_taken_for_the_declared_one(larger):
    """One corner less at one end leaves one place for the declared board, the wrong one."""
    board = board_of(larger)
    image, H = picture(board, roll=8, distance=22)
    rim = 3 * board.columns - 1 if larger == "10x6" else 6 * board.columns + 3
    u, v = np.rint(project(H, board.points() * 1000)[rim]).astype(int)
    image[v - 7 : v + 8, u - 7 : u + 8] = 120
    assert board_of("9x6").detect(image).reason == (
        "the corners go on beyond 9x6: the board is a larger one"
    )


@pytest.mark.parametrize(("count", "larger"), [(2, False), (3, False), (4, True), (6, True)])
@pytest.mark.parametrize("side", range(4))
def test_most_of_a_row_beside_a_board_makes_it_a_larger_one(side, count, larger):
    board = np.argwhere(np.ones((6, 6), dtype=bool))
    row = np.stack([np.arange(count), np.full(count, (-1, 6)[side // 2])], axis=1)
    seen = np.concatenate([board, row if side % 2 else row[:, ::-1]])
    assert _goes_on(seen, board) == larger
    aside = row + np.array([7, 0])
    assert not _goes_on(np.concatenate([board, aside]), board)


def test_half_a_board_tells_how_much_was_found():
    board = board_of("9x6")
    image, H = picture(board, roll=0)
    truth = project(H, board.points() * 1000)
    rows, columns = np.indices(image.shape)
    image[rows + columns > truth.mean(axis=0).sum()] = 220
    missing, found = board.detect(image).reason.split(": at most ")
    assert missing == "no chessboard of 9x6 inner corners was found"
    seen = int((truth.sum(axis=1) < truth.mean(axis=0).sum()).sum())
    assert seen - 9 <= int(found.removesuffix(" of 54 corners lie on one")) <= seen


def test_nothing_to_see_is_no_chessboard():
    image = np.full((240, 320), 99, np.uint8)
    assert board_of("9x6").detect(image).reason == "no chessboard of 9x6 inner corners was found"


def test_covered_corners_are_left_out():
    board = board_of("9x6")
    image, H = picture(board, roll=8)
    truth = project(H, board.points() * 1000)
    u, v = np.rint(truth[[20, 21]].mean(axis=0)).astype(int)
    image[v - 8 : v + 9, u - 16 : u + 17] = 120
    seen = board.detect(image)
    assert seen.ids.tolist() == [k for k in range(54) if k not in (20, 21)]
    assert np.abs(seen.pixels - truth[seen.ids]).max() < 0.25


def cluttered(image, H, board, rng):
    """A picture whose surroundings are full of grain, bars, and small boards of other sizes."""
    height, width = image.shape
    grain = cv2.resize(rng.normal(0, 40, (height // 3, width // 3)), (width, height))
    around = np.clip(110 + grain, 0, 255)
    for _ in range(12):
        box = ((rng.uniform(0, width), rng.uniform(0, height)), rng.uniform(5, 60, 2), 0.0)
        bar = cv2.boxPoints((*box[:2], rng.uniform(0, 180))).astype(np.int32)
        cv2.fillPoly(around, [bar], float(rng.uniform(0, 255)))
    x, y = (int(rng.uniform(0, side - 50)) for side in (width, height))
    around[y : y + 40, x : x + 50] = 255.0 * np.kron(np.indices((4, 5)).sum(axis=0) % 2,
                                                     np.ones((10, 10)))  # fmt: skip
    rim = np.array([[-1.5, -1.5], [board.columns + 0.5, -1.5],
                    [board.columns + 0.5, board.rows + 0.5], [-1.5, board.rows + 0.5]])  # fmt: skip
    mask = np.zeros(image.shape, np.uint8)
    cv2.fillPoly(mask, [np.rint(project(H, rim)).astype(np.int32)], 255)
    return np.where(mask > 0, image, around).astype(np.uint8)


@pytest.mark.parametrize("seed", range(6))
def test_it_is_found_among_clutter(seed):
    rng = np.random.default_rng(seed)
    board = board_of("9x6")
    image, H = picture(board, roll=rng.uniform(0, 360), tilt=rng.uniform(0, 50), distance=24)
    seen = board.detect(cluttered(image, H, board, rng))
    assert len(seen.ids) >= 53
    assert np.abs(seen.pixels - project(H, board.points() * 1000)[seen.ids]).max() < 0.3


@pytest.mark.parametrize(("size", "blur"), [((1600, 1200), 0.7), ((1600, 1200), 6.0)])
def test_large_images_are_searched_small_and_measured_large(size, blur):
    board = board_of("9x6")
    H = pose_view((8, 5), distance=14, tilt=30, roll=20, focal=1700, centre=(800, 600))
    image = render(chessboard(9, 6, 1.0), H, size=size, samples=2, blur=blur)
    seen = board.detect(image)
    assert len(seen.ids) == 54
    assert np.abs(seen.pixels - project(H, board.points() * 1000)).max() < 0.25 * max(1, blur)


def test_small_squares_in_a_large_image():
    board = board_of("9x6")
    H = pose_view((8, 5), distance=50, tilt=20, roll=20, focal=500, centre=(1000, 300))
    image = render(chessboard(9, 6, 1.0), H, size=(1600, 1200), samples=2)
    seen = board.detect(image)
    assert len(seen.ids) == 54
    assert np.abs(seen.pixels - project(H, board.points() * 1000)).max() < 0.3
