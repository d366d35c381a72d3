"""Tags found and then measured through the camera, in drawn pictures with known truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from handeye_cli import targets
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.records import Camera
from handeye_cli.simulate.render import Appearance, render_target
from handeye_cli.targets.board import Detection
from handeye_cli.targets.drawing import outline_around

CAMERA = Camera(400, 320, 480.0, 480.0, 203.0, 158.0, (-0.2, 0.05, 1e-3, -1e-3, 0.0))
APRILTAG, ARUCO = "apriltag:36h11:48mm:id=7", "aruco:DICT_5X5_100:40mm:id=3"
APRILTAGS, ARUCOS = "apriltag-grid:36h11:3x2:30mm:9mm", "aruco-grid:DICT_4X4_50:3x2:30mm:6mm"


class Scene:
    """A target before the camera; its whole width would have `width` pixels seen from the front."""

    def __init__(self, text, rng, tilt_deg, width):
        self.board = targets.build(targets.parse(text))
        self.points = self.board.points()
        across = rng.uniform(0, 2 * np.pi)
        tilt = np.radians(tilt_deg) * np.array([np.cos(across), np.sin(across), 0.0])
        R = rotations.exp(tilt) @ rotations.exp(np.array([0.0, 0.0, rng.uniform(-3, 3)]))
        distance = CAMERA.fx * np.ptp(self.points[:, 0]) / width
        aside = distance * rng.uniform(-0.05, 0.05, 2)
        self.pose = se3.from_parts(R, np.append(aside, distance) - R @ self.points.mean(axis=0))
        seen = se3.transform_points(self.pose, self.points)
        self.truth = project(seen, CAMERA.parameters)

    def picture(self, rng, *, margin=None, turned=False, **look):
        drawing = self.board.drawing()
        if margin is not None:
            drawing = replace(drawing, outline=outline_around(self.points[:, :2], margin))
        if turned:
            drawing = replace(drawing, rectangles=self.each_turned(drawing.rectangles))
        look = Appearance(**{"gradient": (0.2, -0.1), "noise": 2.0, **look})
        return render_target(CAMERA, self.pose, drawing, appearance=look, rng=rng)

    def each_turned(self, rectangles):
        """The same dark cells after half a turn of each tag about its own middle."""
        middles = self.points[:, :2].reshape(-1, 4, 2).mean(axis=1)
        centres = (rectangles[:, :2] + rectangles[:, 2:]) / 2
        nearest = np.argmin(np.linalg.norm(centres[:, None] - middles, axis=-1), axis=1)
        return np.tile(2 * middles[nearest], 2) - rectangles[:, [2, 3, 0, 1]]

    def refined(self, grey, camera=CAMERA):
        return self.board.refine(grey, self.board.detect(grey), camera)

    def error(self, seen):
        return seen.pixels - self.truth[seen.ids]


CASES = [
    (APRILTAG, 30, 0.0),
    (APRILTAG, 30, 55.0),
    (APRILTAG, 90, 35.0),
    (APRILTAG, 200, 0.0),
    (APRILTAG, 200, 55.0),
    (ARUCO, 30, 35.0),
    (ARUCO, 90, 0.0),
    (ARUCO, 90, 55.0),
    (APRILTAGS, 200, 35.0),
    (ARUCOS, 200, 0.0),
    (ARUCOS, 200, 55.0),
]


@pytest.mark.parametrize(("text", "width", "tilt_deg"), CASES)
def test_corners_are_exact_and_their_noise_is_honest(text, width, tilt_deg):
    rng = np.random.default_rng([width, int(tilt_deg)])
    errors, sigmas = [], []
    for _ in range(4 if "grid" not in text else 1):
        scene = Scene(text, rng, tilt_deg, width)
        seen = scene.refined(scene.picture(rng))
        assert len(seen.ids) == len(scene.truth)
        errors.append(scene.error(seen).ravel())
        sigmas.append(seen.sigma_px)
    error = np.concatenate(errors)
    rms = np.sqrt(np.mean(error**2))
    assert rms < (0.03 if width == 30 else 0.015)
    # the corners of a tag share sides: half as many free squares as there are coordinates
    free = len(error) / 2
    low, high = np.sqrt(stats.chi2.ppf([1e-4, 1 - 1e-4], free) / free)
    assert low < rms / np.sqrt(np.mean(np.square(sigmas))) < 1.1 * high


def test_there_is_no_common_offset():
    """Half a pixel is what other refinements of tags are off by."""
    rng = np.random.default_rng(3)
    errors, sigmas = [], []
    for _ in range(6):
        scene = Scene(APRILTAG, rng, 25.0, 100)
        seen = scene.refined(scene.picture(rng))
        errors.append(scene.error(seen))
        sigmas.append(seen.sigma_px)
    mean = np.concatenate(errors).mean(axis=0)
    # neighbouring corners are related: an effective 12 of the 24
    assert np.all(np.abs(mean) < 4 * np.mean(sigmas) / np.sqrt(12))


@pytest.mark.parametrize("text", [APRILTAG, ARUCOS])
def test_it_is_twenty_times_nearer_than_what_was_detected(text):
    rng = np.random.default_rng(5)
    scene = Scene(text, rng, 40.0, 170)
    grey = scene.picture(rng)
    rough = scene.board.detect(grey)
    fine = scene.board.refine(grey, rough, CAMERA)
    before, after = (np.sqrt(np.mean(scene.error(each) ** 2)) for each in (rough, fine))
    assert after < 0.05 * before


def test_a_margin_of_one_cell_on_a_dark_table_is_enough():
    rng = np.random.default_rng(7)
    for width, limit in ((40, 0.03), (100, 0.015)):
        scene = Scene(APRILTAG, rng, 40.0, width)
        seen = scene.refined(scene.picture(rng, margin=0.006, background=20.0))
        assert np.sqrt(np.mean(scene.error(seen) ** 2)) < limit


def test_a_grid_of_tags_that_are_printed_upside_down():
    rng = np.random.default_rng(9)
    scene = Scene(APRILTAGS, rng, 20.0, 200)
    seen = scene.refined(scene.picture(rng, turned=True))
    assert len(seen.ids) == 24
    assert np.sqrt(np.mean(scene.error(seen) ** 2)) < 0.015


def test_without_a_camera_sides_are_straight():
    rng = np.random.default_rng(11)
    scene = Scene(APRILTAG, rng, 30.0, 90)
    seen = scene.refined(scene.picture(rng), camera=None)
    assert np.abs(scene.error(seen)).max() < 0.15


def test_a_covered_tag_of_a_grid_is_left_out():
    rng = np.random.default_rng(13)
    scene = Scene(ARUCOS, rng, 15.0, 200)
    grey = scene.picture(rng)
    rough = scene.board.detect(grey)
    u, v = np.rint(scene.truth[8:10].mean(axis=0)).astype(int)
    grey[v - 6 : v + 7, u - 6 : u + 7] = 130
    seen = scene.board.refine(grey, rough, CAMERA)
    assert seen.ids.tolist() == [*range(8), *range(12, 24)]
    assert np.abs(scene.error(seen)).max() < 0.05


def test_a_single_tag_that_is_covered_in_part_gives_a_reason():
    rng = np.random.default_rng(17)
    scene = Scene(ARUCO, rng, 15.0, 100)
    grey = scene.picture(rng)
    rough = scene.board.detect(grey)
    u, v = np.rint(scene.truth[:2].mean(axis=0)).astype(int)
    grey[v - 10 : v + 11, u - 10 : u + 11] = 130
    seen = scene.board.refine(grey, rough, CAMERA)
    assert seen.reason == "the tag is covered in part, too small, too blurred or too faint"


def test_where_no_tags_are_there_is_a_reason():
    rng = np.random.default_rng(19)
    scene = Scene(ARUCOS, rng, 10.0, 200)
    rough = scene.board.detect(scene.picture(rng))
    noise = np.clip(rng.normal(128, 20, (CAMERA.height, CAMERA.width)), 0, 255).astype(np.uint8)
    for grey in (noise, np.full_like(noise, 128), np.zeros_like(noise)):
        reason = scene.board.refine(grey, rough, CAMERA).reason
        assert reason is not None
        assert reason.startswith("all 6 tags that were found are covered in part")


def test_white_tags_on_black_are_not_found():
    rng = np.random.default_rng(23)
    scene = Scene(ARUCO, rng, 10.0, 100)
    grey = scene.picture(rng, ink=205.0, paper=35.0, background=35.0)
    assert scene.refined(grey).reason == "no tag of DICT_5X5_100 was found"


def test_what_was_not_found_stays_so():
    rng = np.random.default_rng(29)
    board = Scene(ARUCO, rng, 0.0, 100).board
    blank = np.full((CAMERA.height, CAMERA.width), 128, dtype=np.uint8)
    missing = board.detect(blank)
    assert board.refine(blank, missing, CAMERA) is missing


@pytest.mark.parametrize("seed", range(5))
def test_whatever_is_taken_for_a_tag_ends_in_corners_or_a_reason(seed):
    """Bent quads of 3 to 100 pixels in noise, some of them outside of the image."""
    rng = np.random.default_rng([31, seed])
    board = targets.build(targets.parse(ARUCO))
    grey = rng.integers(0, 256, (90, 120)).astype(np.uint8)
    for camera in (None, CAMERA):
        size = 10 ** rng.uniform(0.5, 2)
        square = size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2
        quad = rng.uniform(0, 120, 2) + square + 0.1 * size * rng.uniform(-1, 1, (4, 2))
        seen = board.refine(grey, Detection.whole(quad), camera)
        assert np.all(np.isfinite(seen.pixels))
        assert (seen.reason is None) == (len(seen.ids) == 4)
