from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from targets.rendering import bitmap, pose_view, project, render

from handeye_cli import targets
from handeye_cli.records import Camera, TargetSpec
from handeye_cli.targets.board import Detection

SHARED = (Path(__file__).resolve().parents[2] / "../shared/data").resolve()


def drawing(columns, rows, *, legacy=False, dictionary=cv2.aruco.DICT_6X6_250):
    board = cv2.aruco.CharucoBoard(
        (columns, rows), 1.0, 0.7, cv2.aruco.getPredefinedDictionary(dictionary)
    )
    board.setLegacyPattern(legacy)
    return bitmap(board.generateImage((columns * 40, rows * 40)), -1, -1, columns, rows)


def board_of(shape, tail=""):
    return targets.build(targets.parse(f"charuco:{shape}:1mm:0.7mm:DICT_6X6_250{tail}"))


@cache
def drawn(columns, rows, *, size=(480, 360), aim=None, roll=10.0, tilt=20.0, legacy=False):
    H = pose_view(aim or (columns - 2, rows - 2), distance=14, tilt=tilt, about=40, roll=roll,
                  focal=550, centre=(size[0] / 2, size[1] / 2))  # fmt: skip
    return render(drawing(columns, rows, legacy=legacy), H, size=size), H


def picture(columns, rows, **view):
    image, H = drawn(columns, rows, **view)
    return image.copy(), H


def check(board, seen, H):
    assert seen.reason is None
    error = np.abs(seen.pixels - project(H, board.points()[seen.ids] * 1000))
    assert np.sqrt(np.mean(error**2)) < 0.08
    assert error.max() < 0.3


@pytest.mark.parametrize("roll", [10, 100, 190, 280])
def test_all_corners_have_their_ids_however_the_board_is_turned(roll):
    board = board_of("5x7")
    image, H = picture(5, 7, roll=roll)
    seen = board.detect(image)
    assert seen.ids.tolist() == list(range(24))
    check(board, seen, H)
    # without half a pixel of offset, as some versions of OpenCV had
    offset = (seen.pixels - project(H, board.points() * 1000)).mean(axis=0)
    assert np.abs(offset).max() < 0.05


@pytest.mark.parametrize("legacy", [False, True])
def test_both_layouts_are_tried_when_the_rows_are_even(legacy):
    image, H = picture(5, 6, legacy=legacy)
    right, wrong = (":legacy", ":legacy=false") if legacy else (":legacy=false", ":legacy")
    for tail in ("", right):
        seen = board_of("5x6", tail).detect(image)
        assert len(seen.ids) == 20
        check(board_of("5x6"), seen, H)
    assert "0 of 20 corners" in board_of("5x6", wrong).detect(image).reason


@pytest.mark.parametrize("legacy", [False, True])
def test_the_layout_that_fits_is_noted_and_settled_for_the_recording(legacy):
    board = board_of("5x6")
    detections = [board.detect(picture(5, 6, legacy=legacy, roll=roll)[0]) for roll in (10, 40)]
    name = "layout of OpenCV before 4.6 (legacy)" if legacy else "layout of OpenCV 4.6 and later"
    assert [seen.note for seen in detections] == [name, name]
    # one image in which the other layout seemed to fit, and one without the board
    other = board.detect(picture(5, 6, legacy=not legacy)[0])
    stray = Detection(other.ids[:4], other.pixels[:4], note=other.note)
    settled, finding = board.settled([stray, *detections, Detection.missing("none")])
    assert settled.legacy is legacy
    assert targets.parse(targets.shorthand(settled.spec)) == settled.spec
    assert (finding.code, finding.severity) == ("charuco-layout", "info")
    assert f"with 6 rows of squares the board has one of two layouts; 2 of 3 images that show it " \
           f"have the {name}" == finding.message  # fmt: skip
    assert f"legacy: {str(legacy).lower()}" in finding.advice
    assert settled.settled(detections) == (settled, None)


@pytest.mark.parametrize(("shape", "tail"), [("5x7", ""), ("5x6", ":legacy"), ("5x7", ":legacy")])
def test_a_layout_that_is_known_needs_no_note(shape, tail):
    board = board_of(shape, tail)
    seen = board.detect(picture(5, int(shape[-1]), legacy=bool(tail))[0])
    assert seen.note is None
    assert board.settled([seen]) == (board, None)


def test_no_image_settles_nothing():
    board = board_of("5x6")
    assert board.settled([]) == (board, None)
    assert board.settled([Detection.missing("no marker")]) == (board, None)


def test_part_of_a_board_gives_the_corners_that_are_seen():
    board = board_of("5x7")
    image, H = picture(5, 7, aim=(16, 2))
    seen = board.detect(image)
    assert 4 <= len(seen.ids) < 24
    assert (np.diff(seen.ids) > 0).all()
    check(board, seen, H)


def test_too_few_corners_are_counted():
    board = board_of("5x7")
    image, _ = picture(5, 7, tilt=0, roll=0)
    corner = board.detect(image).pixels[0]
    # nothing but the surroundings of one row of squares
    image[int(corner[1]) + 15 :] = 220
    reason = board.detect(image).reason
    assert reason.endswith("of 24 corners were found: at least 4 that are not all on one line are "
                           "needed")  # fmt: skip


def test_another_dictionary_is_no_marker():
    board = targets.build(targets.parse("charuco:5x7:1mm:0.7mm:DICT_4X4_50"))
    image, _ = picture(5, 7)
    assert board.detect(image).reason == "no marker of DICT_4X4_50 was found"


def test_every_image_of_the_real_board_gives_all_corners():
    folder = SHARED / "rct-charuco"
    if not folder.is_dir():
        pytest.skip(f"no recording at {folder}")
    recording = yaml.safe_load((folder / "recording.yaml").read_text())
    spec = dict(recording["target"])
    board = targets.build(TargetSpec(spec.pop("type"), spec))
    camera = Camera(**recording["camera"])
    assert len(recording["stations"]) == 16
    for station in recording["stations"]:
        image = cv2.imread(str(folder / station["image"]), cv2.IMREAD_GRAYSCALE)
        seen = board.detect(image)
        assert seen.ids.tolist() == list(range(24)), station["name"]
        H, _ = cv2.findHomography(board.points()[:, :2], seen.pixels)
        # distortion of the lens and a bent board are left in
        assert np.abs(seen.pixels - project(H, board.points())).max() < 2.0
        fine = board.refine(image, seen, camera)
        assert len(fine.ids) >= 20, station["name"]
        assert np.abs(fine.pixels - seen.pixels[fine.ids]).max() < 0.5
        assert 0.005 < fine.sigma_px < 0.05
