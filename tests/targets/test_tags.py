import cv2
import numpy as np
import pytest
from targets.rendering import bitmap, pose_view, project, render, together

from handeye_cli import targets
from handeye_cli.records import TargetSpec

# ids 0 to 5 of the family 36h11 as its authors publish them, row by row, 1 being white
TAG36H11 = [0xD5D628584, 0xD97F18B49, 0xDD280910E, 0xE479E9C98, 0xEBCBCA822, 0xF31DAB3AC]


def apriltag(number, x=0.0, y=0.0, *, upside_down=False):
    bits = np.array([bit == "1" for bit in f"{TAG36H11[number]:036b}"]).reshape(6, 6)
    image = np.pad(np.where(bits, 255, 0).astype(np.uint8), 1)
    return bitmap(np.rot90(image, 2) if upside_down else image, x, y, 1.0, 1.0)


def aruco(number, x=0.0, y=0.0):
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100)
    return bitmap(cv2.aruco.generateImageMarker(dictionary, number, 7), x, y, 1.0, 1.0)


def board_of(text):
    return targets.build(targets.parse(text))


def picture(colour, size=(1.0, 1.0), *, distance=4.0, roll=0.0):
    H = pose_view(size, distance=distance, tilt=20, about=60, roll=roll)
    return render(colour, H), H


def check(board, seen, H, image):
    """The corners as they are found, then as they are measured."""
    assert seen.reason is None
    truth = project(H, board.points()[seen.ids] * 1000)
    assert np.abs(seen.pixels - truth).max() < 2.0
    fine = board.refine(image, seen, None)
    assert fine.ids.tolist() == seen.ids.tolist()
    assert np.sqrt(np.mean((fine.pixels - truth) ** 2)) < 0.03


@pytest.mark.parametrize("roll", [5, 95, 185, 275])
@pytest.mark.parametrize(
    ("text", "colour"),
    [("apriltag:36h11:1mm", apriltag(3)), ("aruco:DICT_5X5_100:1mm", aruco(3))],
    ids=["apriltag", "aruco"],
)
def test_corners_of_a_tag_start_at_the_top_left_of_the_upright_tag(text, colour, roll):
    image, H = picture(colour, roll=roll)
    seen = board_of(text).detect(image)
    assert seen.ids.tolist() == [0, 1, 2, 3]
    check(board_of(text), seen, H, image)


def test_points_of_a_tag_go_around_it_from_the_top_left():
    points = board_of("apriltag:36h11:48mm").points()
    np.testing.assert_allclose(points, [[0, 0, 0], [0.048, 0, 0], [0.048, 0.048, 0], [0, 0.048, 0]])


def test_one_of_several_tags_must_be_named():
    image, H = picture(together(aruco(7), aruco(4, 1.5)), (2.5, 1), distance=6)
    reason = board_of("aruco:DICT_5X5_100:1mm").detect(image).reason
    assert reason == "several tags were found, with the ids 4, 7: name one"
    named = board_of("aruco:DICT_5X5_100:1mm:id=7")
    check(named, named.detect(image), H, image)
    other = board_of("aruco:DICT_5X5_100:1mm:id=9").detect(image)
    assert other.reason == "tag 9 was not found, but those with the ids 4, 7"


def test_a_tag_that_is_seen_twice_is_not_guessed():
    image, _ = picture(together(aruco(7), aruco(7, 1.5)), (2.5, 1), distance=6)
    reason = board_of("aruco:DICT_5X5_100:1mm:id=7").detect(image).reason
    assert reason == "tag 7 was found several times: one must be seen"
    reason = board_of("aruco:DICT_5X5_100:1mm").detect(image).reason
    several = "no tag of DICT_5X5_100 was found just once, but several with the ids 7"
    assert reason == several
    reason = board_of("aruco-grid:DICT_5X5_100:4x2:1mm:0.4mm").detect(image).reason
    assert reason == several


def grid(draw, columns=3, rows=2, *, upwards=False, only=None, **options):
    places = [(number, *divmod(number, columns)) for number in range(columns * rows)]
    return together(
        *[
            draw(number, column * 1.4, (rows - 1 - row if upwards else row) * 1.4, **options)
            for number, row, column in places
            if only is None or number in only
        ]
    )


GRIDS = [
    ("aruco-grid:DICT_5X5_100:3x2:1mm:0.4mm", aruco, {}),
    ("apriltag-grid:36h11:3x2:1mm:0.4mm", apriltag, {}),
    ("apriltag-grid:36h11:3x2:1mm:0.4mm", apriltag, {"upside_down": True}),
]


@pytest.mark.parametrize(("text", "draw", "options"), GRIDS, ids=["aruco", "upright", "turned"])
def test_a_grid_of_tags_is_found_whole_and_in_part(text, draw, options):
    board = board_of(text)
    image, H = picture(grid(draw, **options), (3.8, 2.4), distance=9, roll=200)
    seen = board.detect(image)
    assert seen.ids.tolist() == list(range(24))
    check(board, seen, H, image)
    image, H = picture(grid(draw, only=[1, 5], **options), (3.8, 2.4), distance=9, roll=200)
    seen = board.detect(image)
    assert seen.ids.tolist() == [4, 5, 6, 7, 20, 21, 22, 23]
    check(board, seen, H, image)


@pytest.mark.parametrize(("text", "draw", "options"), GRIDS, ids=["aruco", "upright", "turned"])
def test_a_grid_numbered_from_below_is_refused(text, draw, options):
    image, _ = picture(grid(draw, upwards=True, **options), (3.8, 2.4), distance=9)
    assert board_of(text).detect(image).reason.startswith("6 tags were found, but not where")


def test_tags_that_are_not_of_the_grid_do_not_count():
    image, _ = picture(together(aruco(50), aruco(51, 1.4)), (2.4, 1), distance=9)
    board = board_of("aruco-grid:DICT_5X5_100:3x2:1mm:0.4mm")
    assert board.detect(image).reason == "no tag of DICT_5X5_100 was found"


def test_one_apriltag_of_a_grid_leaves_open_which_way_up_it_is_printed():
    image, _ = picture(grid(apriltag, only=[2]), (3.8, 2.4), distance=9)
    board = board_of("apriltag-grid:36h11:3x2:1mm:0.4mm")
    assert board.detect(image).reason == "1 tag was found: at least 2 are needed"


def test_corners_of_a_grid_are_a_tag_and_a_gap_apart():
    parameters = {"family": "36h11", "columns": 3, "rows": 2, "size_mm": 55, "gap_mm": 16.5}
    points = targets.build(TargetSpec("apriltag-grid", parameters)).points()
    np.testing.assert_allclose(
        points[[4, 5, 12]] * 1e3, [[71.5, 0, 0], [126.5, 0, 0], [0, 71.5, 0]]
    )
