from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from targets.rendering import discs, pose_view, project, render

from handeye_cli import targets
from handeye_cli.records import TargetSpec

SHARED = (Path(__file__).resolve().parents[2] / "../shared/data").resolve()


def board_of(text):
    board = targets.build(targets.parse(text))
    return board, board.points()[:, :2] * 1000


def diameters_of(board):
    diameters = np.full(len(board.points()), board.diameter_mm)
    if getattr(board, "corner_diameter_mm", None):
        diameters[0] = board.corner_diameter_mm
    return diameters


def errors(board, detection, H):
    assert detection.reason is None
    expected = project(H, board.points()[detection.ids] * 1000)
    return np.linalg.norm(detection.pixels - expected, axis=1)


def area(detection, board):
    """Of the grid in the image: positive when it is seen from the front."""
    corner, right, down = detection.pixels[[0, board.columns - 1, -board.columns]]
    return np.linalg.det(np.stack([right - corner, down - corner]))


def ellipse_centres(H, centres, diameter):
    """Where the outlines of discs have their centres in the image, by their conics."""
    back = np.linalg.inv(H)
    found = []
    for x, y in centres:
        circle = np.array([[1, 0, -x], [0, 1, -y], [-x, -y, x * x + y * y - diameter**2 / 4]])
        pole = np.linalg.solve(back.T @ circle @ back, [0.0, 0.0, 1.0])
        found.append(pole[:2] / pole[2])
    return np.array(found)


@pytest.mark.parametrize(("tilt", "dark"), [(0, True), (20, False), (40, True)])
def test_the_centres_of_the_ellipses_are_measured(tilt, dark):
    board, centres = board_of("disc-grid:6x6:5mm:3mm")
    H = pose_view((25, 25), distance=60, tilt=tilt, about=70, roll=12)
    seen = board.detect(render(discs(centres, 3.0, dark=dark), H, seed=tilt))
    assert len(seen.ids) == 36
    assert np.abs(seen.pixels - ellipse_centres(H, centres, 3.0)).max() < 0.1
    # a disc's own centre is beside it
    assert errors(board, seen, H).max() < (0.15 if tilt < 30 else 0.25)


@pytest.mark.parametrize("roll", [0, 90, 180, 270])
def test_a_plain_plate_starts_at_the_top_left_of_the_image_and_is_not_mirrored(roll):
    board, centres = board_of("disc-grid:7x5:5mm:3mm")
    H = pose_view((30, 20), distance=70, tilt=25, about=120, roll=roll + 8)
    seen = board.detect(render(discs(centres, 3.0), H))
    assert area(seen, board) > 0
    assert any(
        np.allclose(seen.pixels, project(H, centres[turn]), atol=0.3) for turn in board.turns()
    )
    others = [seen.pixels[turn[0]].sum() for turn in board.turns()]
    assert seen.pixels[0].sum() == min(others)


@pytest.mark.parametrize("shape", ["6x6", "7x5"])
@pytest.mark.parametrize("roll", [0, 90, 180, 270])
def test_the_larger_corner_disc_is_point_0_however_the_plate_is_turned(roll, shape):
    dark = (roll in (0, 90)) == (shape == "6x6")  # each colour with every shape and turn of axes
    board, centres = board_of(f"disc-grid:{shape}:5mm:2.5mm:4mm")
    size = centres.max(axis=0)
    H = pose_view(size, distance=70, tilt=25, about=120, roll=roll + 8)
    seen = board.detect(render(discs(centres, diameters_of(board), dark=dark), H, seed=roll))
    assert area(seen, board) > 0
    assert errors(board, seen, H).max() < 0.3


def test_a_corner_disc_as_wide_as_the_pitch_is_told():
    board, centres = board_of("disc-grid:6x6:5mm:2.5mm:5mm")
    H = pose_view((25, 25), distance=70, tilt=20, roll=200)
    seen = board.detect(render(discs(centres, diameters_of(board)), H))
    assert errors(board, seen, H)[1:].max() < 0.15


def test_discs_of_more_than_a_hundred_pixels_are_found():
    board, centres = board_of("disc-grid:3x3:5mm:3.6mm")
    H = pose_view((10, 10), distance=11, roll=4, focal=360, centre=(320, 240))
    seen = board.detect(render(discs(centres, 3.6), H, size=(640, 480), samples=3))
    assert np.linalg.norm(H @ [1.8, 0, 1] / (H @ [1.8, 0, 1])[2] - H @ [-1.8, 0, 1]
                          / (H @ [-1.8, 0, 1])[2]) > 100  # fmt: skip
    assert errors(board, seen, H).max() < 0.15


def test_a_larger_corner_that_is_not_there_is_not_guessed():
    board, centres = board_of("disc-grid:6x6:5mm:2.5mm:4mm")
    H = pose_view((25, 25), distance=70, roll=8)
    seen = board.detect(render(discs(centres, 2.5), H))
    assert len(seen.ids) == 0
    assert "the larger corner disc cannot be told: expected one 1.60 times" in seen.reason


def test_a_larger_disc_at_a_wrong_corner_says_that_columns_and_rows_are_swapped():
    board, centres = board_of("disc-grid:7x5:5mm:2.5mm:4mm")
    diameters = np.full(35, 2.5)
    diameters[6] = 4.0
    H = pose_view((30, 20), distance=70, roll=8)
    seen = board.detect(render(discs(centres, diameters), H))
    assert "point 0 of 5x7 discs, not of 7x5" in seen.reason


def test_a_disc_that_the_image_cuts_is_left_out():
    board, centres = board_of("disc-grid:6x6:5mm:3mm")
    left_out = 0
    for edge in (-0.6, -0.2, 0.3, 2.0):
        # the left edge of the discs of the first column, in pixels
        H = pose_view((25, 25), distance=60, centre=(edge + 14 * 350 / 60, 120))
        seen = board.detect(render(discs(centres, 3.0), H))
        if seen.reason is None:
            assert errors(board, seen, H).max() < 0.1
            left_out += len(seen.ids) < 36
            assert set(range(36)) - set(seen.ids) <= set(range(0, 36, 6))
    assert left_out > 0
    assert len(seen.ids) == 36


def test_half_a_plate_says_where_it_leaves_the_image():
    board, centres = board_of("disc-grid:6x6:5mm:3mm")
    H = pose_view((25, 25), distance=60, centre=(0, 120))
    seen = board.detect(render(discs(centres, 3.0), H))
    assert seen.reason == "18 of 36 discs: the plate leaves the image on the left"


def test_a_plate_that_is_not_a_plane_grid_is_refused():
    board, centres = board_of("disc-grid:6x6:5mm:2mm")
    H = pose_view((25, 25), distance=60)
    moved = centres.copy()
    moved[14] += [1.5, -1.3]
    seen = board.detect(render(discs(moved, 2.0), H))
    assert "no grid of 6x6" in seen.reason


def test_a_plate_on_a_slope_of_light_with_a_dark_table_around_is_measured():
    board, centres = board_of("disc-grid:6x6:5mm:3mm")
    H = pose_view((25, 25), distance=60, tilt=15, roll=5)
    plate = discs(centres, 3.0)

    def shaded(x, y):
        inside = (abs(x - 12.5) < 16) & (abs(y - 12.5) < 16)
        return np.where(inside, plate(x, y) * (0.75 + 0.015 * (x - 12.5)), 0.1)

    seen = board.detect(render(shaded, H))
    assert errors(board, seen, H).max() < 0.15


@pytest.mark.parametrize(
    ("roll", "shape"),
    [*((roll, "4x11") for roll in (0, 90, 180, 270)), (90, "4x10"), (180, "4x10"), (270, "3x6")],
)
def test_asymmetric_circles_are_ordered_however_the_plate_is_turned(roll, shape):
    board, centres = board_of(f"asymmetric-circles:{shape}:2mm:1.5mm")
    H = pose_view(centres.max(axis=0), distance=40, tilt=20, about=30, roll=roll + 8)
    seen = board.detect(render(discs(centres, 1.5), H, seed=roll))
    assert seen.reason is None
    fits = [np.abs(seen.pixels - project(H, centres[turn])).max() for turn in board.turns()]
    assert min(fits) < 0.15
    if len(fits) == 1:
        assert errors(board, seen, H).max() < 0.2


def test_asymmetric_circles_have_a_half_turn_when_the_rows_are_even():
    odd, even = (board_of(f"asymmetric-circles:4x{n}:20mm:10mm")[0] for n in (11, 10))
    assert len(odd.turns()) == 1
    identity, half = even.turns()
    np.testing.assert_array_equal(half, identity[::-1])


def test_neighbours_in_a_row_are_two_spacings_apart():
    _, centres = board_of("asymmetric-circles:4x11:20mm:10mm")
    assert centres[:5].tolist() == [[0, 0], [40, 0], [80, 0], [120, 0], [20, 20]]


def test_every_image_of_the_real_plate_is_found_on_a_plane():
    folder = SHARED / "rct-10x10"
    if not folder.is_dir():
        pytest.skip(f"no recording at {folder}")
    recording = yaml.safe_load((folder / "recording.yaml").read_text())
    spec = dict(recording["target"])
    board = targets.build(TargetSpec(spec.pop("type"), spec))
    assert len(recording["stations"]) == 15
    for station in recording["stations"]:
        seen = board.detect(cv2.imread(str(folder / station["image"]), cv2.IMREAD_GRAYSCALE))
        assert seen.reason is None, station["name"]
        assert len(seen.ids) >= 99
        # the larger disc is the one at the end of the printed text, which is left of the plate
        H, _ = cv2.findHomography(board.points()[seen.ids, :2], seen.pixels)
        residual = seen.pixels - project(H, board.points()[seen.ids])
        # the lens' distortion is left in, a disc of a wrong place would be 10 pixels off
        assert np.abs(residual).max() < 1.7
