"""What people are told when no grid of discs was found: pictures with one known fault each."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from targets.rendering import discs, pose_view, render

from handeye_cli import targets
from handeye_cli.targets.disc_reasons import Attempts

PLATE = "disc-grid:6x6:5mm:4mm"
SIDE = (25, 25)
DATA = (Path(__file__).resolve().parents[2] / "../shared/data").resolve()


def reason(image, text=PLATE):
    seen = targets.build(targets.parse(text)).detect(image)
    assert seen.reason is not None
    assert len(seen.ids) == 0
    return seen.reason


def plate(text=PLATE, *, distance=60.0, tilt=15.0, roll=8.0, keep=None, **look):
    board = targets.build(targets.parse(text))
    centres = board.points()[:, :2] * 1000
    H = pose_view(np.ptp(centres, axis=0), distance=distance, tilt=tilt, roll=roll)
    return render(discs(centres, board.diameter_mm, keep=keep), H, samples=2, **look)


def flat(level):
    return np.full((240, 320), level, dtype=np.uint8)


def noisy(level, sigma):
    rng = np.random.default_rng(4)
    return np.clip(np.rint(rng.normal(level, sigma, (240, 320))), 0, 255).astype(np.uint8)


@pytest.mark.parametrize(
    ("image", "words"),
    [
        (flat(0), "from 0 to 0, it is too dark"),
        (flat(255), "from 255 to 255, it is overexposed"),
        (flat(99), "from 99 to 99"),
        (noisy(120, 3), "the image has nothing but grey levels from 1"),
        (noisy(3, 1), "it is too dark"),
    ],
    ids=["black", "white", "grey", "lid", "night"],
)
def test_an_image_of_nothing_is_called_that(image, words):
    said = reason(image)
    assert said.startswith("0 of 36 discs were found: the image has nothing but grey levels from")
    assert words in said


def test_a_fault_of_the_sensor_does_not_make_an_image_of_something():
    image = flat(20)
    image[100, 200] = 255
    assert "it is too dark" in reason(image)


@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize(("width", "blur"), [(2.5, 0.5), (2.8, 0.8)])
def test_tiny_discs_are_too_small_and_not_absent(width, blur, inverted):
    image = plate(distance=350 * 4 / width, blur=blur)
    said = reason(255 - image if inverted else image)
    count = int(said.partition("some ")[2].split()[0])
    apart = float(said.partition(" lie ")[2].split()[0])
    assert 24 <= count <= 40
    assert apart == pytest.approx(1.25 * width, rel=0.15)
    assert said.endswith("px apart, too small for discs, at least 6 px are needed")


def test_discs_below_the_smallest_width_are_measured():
    attempts = Attempts(36, "6x6")
    attempts.saw(np.linspace(4.6, 5.4, 27))
    assert attempts.reason(plate()) == (
        "27 of 36 discs were found: they are 5.0 px wide, at least 6 px are needed"
    )


def test_a_texture_is_no_plate_of_tiny_discs():
    rng = np.random.default_rng(1)
    grain = rng.integers(0, 256, (60, 80), dtype=np.uint8)
    for size in (2, 4):
        image = cv2.resize(grain, None, fx=size, fy=size, interpolation=cv2.INTER_CUBIC)
        assert "too small" not in reason(image)


@pytest.mark.parametrize("blur", [6.0, 12.0])
def test_a_blurred_image_is_called_blurred_with_the_width_of_its_edges(blur):
    said = reason(plate(distance=90, blur=blur))
    width = float(said.partition("its sharpest edge is ")[2].split()[0])
    # a step blurred by a Gaussian rises over sqrt(2 pi) sigma; neighbouring discs cut it short
    assert 8 < width < 2.6 * blur
    assert "the image is blurred" in said


@pytest.mark.parametrize("angle", [0.0, 60.0])
def test_a_motion_is_called_one_where_there_are_discs(angle):
    kernel = np.zeros((41, 41), dtype=np.float32)
    ends = 20 + 14 * np.outer([-1, 1], [np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    (x0, y0), (x1, y1) = np.rint(16 * ends).astype(int).tolist()
    cv2.line(kernel, (x0, y0), (x1, y1), 1.0, 1, cv2.LINE_AA, 4)
    image = cv2.filter2D(plate(distance=50), -1, kernel / kernel.sum())
    attempts = Attempts(36, "6x6")
    assert attempts.reason(image) == "0 of 36 discs were found"
    attempts.saw(np.full(30, 20.0))
    said = attempts.reason(image)
    assert "the image is blurred in one direction, as by motion: edges are" in said
    across, along = map(
        int, re.search(r"(\d+) px wide across it and (\d+) px along", said).groups()
    )
    assert 12 < across < 40
    assert along < 8


@pytest.mark.parametrize(
    ("cut", "where"),
    [
        (np.s_[:, 130:], "on the left"),
        (np.s_[:, :190], "on the right"),
        (np.s_[90:], "on the top"),
        (np.s_[90:, :190], "on the top and right"),
    ],
)
def test_a_plate_that_leaves_the_image_says_where(cut, where):
    said = reason(np.ascontiguousarray(plate(tilt=0, roll=0)[cut]))
    found = int(said.split()[0])
    assert 4 <= found < 30
    assert said == f"{found} of 36 discs: the plate leaves the image {where}"


@pytest.mark.parametrize("declared", ["7x6", "6x8", "9x9"])
def test_a_smaller_plate_than_declared_is_said_to_be_another(declared):
    columns, rows = map(int, declared.split("x"))
    missing = columns * rows - 36
    assert reason(plate(distance=110), f"disc-grid:{declared}:5mm:4mm") == (
        f"36 of {columns * rows} discs were found: {missing} are missing inside the image, they "
        f"are covered or the plate is none of {declared}"
    )


@pytest.mark.parametrize("declared", ["5x6", "6x5", "3x3"])
def test_a_larger_plate_than_declared_fits_several_places(declared):
    assert reason(plate(), f"disc-grid:{declared}:5mm:4mm") == (
        f"the discs go on beyond {declared}: the declared grid fits several places"
    )


def test_every_second_disc_of_a_grid_is_no_plate():
    """Between 3x3 discs at twice the pitch lie 16 others, and 20 around them."""
    said = reason(plate(tilt=30), "disc-grid:3x3:10mm:4mm")
    count, _, rest = said.partition(" ")
    assert rest == "more discs as large lie between those of 3x3: the plate is another one"
    assert 16 <= int(count) <= 24


@pytest.mark.parametrize(
    ("image", "declared", "words"),
    [
        ("rct-10x10/images/01.png", "asymmetric-circles:4x5:20mm:10mm", "lie between those of"),
        ("rct-10x10/images/02.png", "disc-grid:5x5:50.8mm:12.7mm", "lie between those of 5x5"),
        # the step that finds these alone does not see the tenth row, which others do
        ("rct-10x10/images/06.png", "disc-grid:9x10:25.4mm:12.7mm", "go on beyond 9x10"),
        ("rct-10x10/images/11.png", "disc-grid:9x10:25.4mm:12.7mm", "go on beyond 9x10"),
        # squares of a ChArUco board
        ("rct-charuco/images/06.png", "asymmetric-circles:3x5:18mm:9mm", "3x5"),
    ],
)
def test_a_real_plate_is_none_of_those_that_lie_on_it(image, declared, words):
    path = DATA / image
    if not path.exists():
        pytest.skip("the real recordings are not beside this checkout")
    grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert words in reason(np.asarray(grey), declared)


def test_covered_discs_are_counted():
    keep = np.setdiff1d(np.arange(36), [7, 8, 13, 14, 28])
    said = reason(plate(keep=keep))
    assert said.startswith("31 of 36 discs were found: 5 are missing inside the image, they are")


def test_few_of_many_spots_on_a_lattice_make_the_declaration_doubtful():
    attempts = Attempts(36, "6x6")
    attempts.saw(np.full(40, 9.0))
    attempts.fitted(17, [np.array([box(50.0 + k, 60.0) for k in range(36)])], (240, 320))
    assert attempts.reason(plate()) == (
        "40 spots like discs were found, but no grid of 6x6 among them: at most 17 lie on one; "
        "are the numbers, diameter and spacing of its discs as declared?"
    )


def test_a_plate_all_of_whose_discs_are_there_has_other_edges():
    attempts = Attempts(36, "6x6")
    attempts.saw(np.full(36, 9.0))
    attempts.fitted(36, [np.array([box(50.0 + k, 60.0) for k in range(36)])], (240, 320))
    assert attempts.reason(plate()).startswith("36 of 36 discs were found: their edges are not")


def test_a_cut_plate_in_a_blurred_image_is_cut_when_sure_and_blurred_when_not():
    image = plate(distance=90, blur=12.0)
    outside = np.array([box(-9.0, 50.0)] * 20 + [box(90.0, 90.0)] * 16)
    for spots, word in ((17, "leaves the image on the left"), (60, "the image is blurred")):
        attempts = Attempts(36, "6x6")
        attempts.saw(np.full(spots, 9.0))
        attempts.fitted(16, [outside], (240, 320))
        assert word in attempts.reason(image)


def test_no_plate_at_all():
    rng = np.random.default_rng(2)
    image = flat(180)
    for x, y, width, height in rng.integers(10, 90, (12, 4)).tolist():
        cv2.rectangle(image, (3 * x, 2 * y), (3 * x + width, 2 * y + height), 3 * width % 255, -1)
    count, _, rest = reason(cv2.GaussianBlur(image, (0, 0), 0.7)).partition(" of 36 discs were")
    assert int(count) < 8
    assert "image" not in rest


def box(x, y, radius=4.0):
    return [[x - radius, y - radius], [x + radius, y + radius]]


def test_a_plate_beyond_all_sides_and_beyond_three():
    grid = [box(50.0 * (k % 6) - 5.0, 50.0 * (k // 6) - 5.0) for k in range(36)]
    for size, where in (((240, 240), "on all sides"), ((400, 240), "on the left, top and right")):
        attempts = Attempts(36, "6x6")
        attempts.saw(np.full(16, 9.0))
        attempts.fitted(16, [np.array(grid)], size)
        attempts.absent = 0
        assert attempts.reason(flat(99)) == f"16 of 36 discs: the plate leaves the image {where}"


def test_a_lattice_by_chance_at_the_rim_is_no_plate():
    attempts = Attempts(36, "6x6")
    attempts.saw(np.full(30, 9.0))
    outside = [box(-20.0, 10.0 * k) for k in range(32)]
    attempts.fitted(4, [np.array([*outside, *[box(50.0, 50.0)] * 4])], (240, 320))
    assert attempts.sides == ["left", "top", "bottom"]
    assert "leaves" not in attempts.reason(noisy(100, 30))


def test_the_best_attempt_counts_with_the_spots_of_its_own():
    attempts = Attempts(36, "6x6")
    inside = np.array([box(50.0 + k, 60.0) for k in range(36)])
    attempts.saw(np.full(34, 9.0))
    attempts.fitted(34, [inside], (240, 320))
    attempts.saw(np.full(80, 9.0))
    attempts.fitted(5, [inside], (240, 320))
    assert (attempts.spots, attempts.covered, attempts.among, attempts.absent) == (80, 34, 34, 2)
    assert attempts.reason(noisy(100, 30)).startswith("34 of 36 discs were found: 2 are missing")
