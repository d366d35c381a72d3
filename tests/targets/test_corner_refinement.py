"""Chessboard and ChArUco corners found and then measured, in drawn pictures with known truth."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from handeye_cli import targets
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.records import Camera
from handeye_cli.simulate.render import Appearance, render_target
from handeye_cli.targets.board import Detection

CAMERA = Camera(640, 480, 700.0, 700.0, 321.0, 239.0, (-0.2, 0.05, 1e-3, -1e-3, 0.0))
CHESS = "chessboard:9x6:5mm"
CHARUCO = "charuco:7x5:5mm:3.5mm:DICT_4X4_50"
LIGHT = Appearance(gradient=(0.2, -0.1), noise=2.0)


def picture(text, rng, tilt_deg, *, width=28.0, look=LIGHT):
    """A drawn picture of a target, with squares of some pixels, and the pixels of its points."""
    board = targets.build(targets.parse(text))
    across = rng.uniform(0, 2 * np.pi)
    tilt = np.radians(tilt_deg) * np.array([np.cos(across), np.sin(across), 0.0])
    R = rotations.exp(tilt) @ rotations.exp(np.array([0, 0, rng.uniform(-3, 3)]))
    distance = CAMERA.fx * board.square_mm * 1e-3 / width
    pose = se3.from_parts(R, np.array([0, 0, distance]) - R @ board.points().mean(axis=0))
    grey = render_target(CAMERA, pose, board.drawing(), appearance=look, rng=rng)
    return board, grey, project(se3.transform_points(pose, board.points()), CAMERA.parameters)


def off(seen, truth):
    return seen.pixels - truth[seen.ids]


def rms(error):
    return float(np.sqrt(np.mean(np.square(error))))


@pytest.mark.parametrize(("text", "tilt_deg"), [(CHESS, 5.0), (CHESS, 50.0), (CHARUCO, 50.0)])
def test_corners_are_exact_and_the_noise_is_honest(text, tilt_deg):
    rng = np.random.default_rng(int(tilt_deg))
    errors, sigmas = [], []
    for _ in range(2 if text == CHESS else 4):
        board, grey, truth = picture(text, rng, tilt_deg)
        seen = board.refine(grey, board.detect(grey), CAMERA)
        assert len(seen.ids) > 0.6 * len(truth)
        errors.append(off(seen, truth).ravel())
        sigmas.append(np.full(errors[-1].size, seen.sigma_px))
    found = rms(np.concatenate(errors))
    assert found < 0.012
    # the mean of 150 squares or more is known within 12 %
    assert rms(np.concatenate(sigmas)) == pytest.approx(found, rel=0.2)


@pytest.mark.parametrize("camera", [CAMERA, None])
def test_it_is_three_times_nearer_than_opencv(camera):
    """Without a camera the map is not exact, but edges are straight nearby."""
    rng = np.random.default_rng(5)
    board, grey, truth = picture(CHESS, rng, 30.0)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-3)
    start = truth.reshape(-1, 1, 2).astype(np.float32)
    best = cv2.cornerSubPix(grey, start, (5, 5), (-1, -1), criteria).reshape(-1, 2)
    seen = board.refine(grey, board.detect(grey), camera)
    assert len(seen.ids) == 54
    assert 3 * rms(off(seen, truth)) < rms(best - truth)


@pytest.mark.parametrize(("width", "limit"), [(9.0, 0.013), (14.0, 0.009), (40.0, 0.005)])
def test_windows_follow_the_size_of_the_squares(width, limit):
    rng = np.random.default_rng(7)
    board, grey, truth = picture(CHESS, rng, 20.0, width=width)
    seen = board.refine(grey, board.detect(grey), CAMERA)
    assert len(seen.ids) == 54
    assert rms(off(seen, truth)) < limit


def test_a_covered_corner_is_left_out():
    rng = np.random.default_rng(11)
    board, grey, truth = picture(CHESS, rng, 10.0)
    rough = board.detect(grey)
    u, v = np.rint(truth[22]).astype(int)
    grey[v - 8 : v + 9, u - 8 : u + 9] = 150
    for seen in (rough, board.detect(grey)):
        fine = board.refine(grey, seen, CAMERA)
        assert 22 not in fine.ids
        assert len(fine.ids) == 53
        assert np.abs(off(fine, truth)).max() < 0.04


def test_corners_on_the_edge_of_a_shadow_are_left_out():
    rng = np.random.default_rng(13)
    board, grey, truth = picture(CHESS, rng, 10.0)
    rough = board.detect(grey)
    columns = np.arange(grey.shape[1])
    grey = (grey * np.where(columns > truth[22, 0] + 3, 0.6, 1.0)).astype(np.uint8)
    seen = board.refine(grey, rough, CAMERA)
    assert 30 < len(seen.ids) < 54
    assert np.abs(off(seen, truth)).max() < 0.06


def test_what_was_not_found_stays_so():
    board = targets.build(targets.parse(CHESS))
    blank = np.full((480, 640), 128, dtype=np.uint8)
    missing = board.detect(blank)
    assert board.refine(blank, missing, CAMERA) is missing


@pytest.mark.parametrize("noise", [0.0, 20.0])
def test_blank_paper_under_the_rough_corners_gives_a_reason(noise):
    rng = np.random.default_rng(17)
    board, grey, _ = picture(CHESS, rng, 10.0)
    rough = board.detect(grey)
    blank = np.clip(rng.normal(128, noise, grey.shape), 0, 255).astype(np.uint8)
    seen = board.refine(blank, rough, CAMERA)
    assert seen.reason == "the edges at 54 corners are too blurred or too faint"


def test_a_part_of_a_charuco_board_keeps_its_ids_and_its_note():
    rng = np.random.default_rng(19)
    board, grey, truth = picture(CHARUCO, rng, 20.0)
    kept = np.array([3, 4, 9, 10, 11])
    rough = Detection(kept, truth[kept] + rng.normal(0, 0.3, (5, 2)), note="a layout")
    seen = board.refine(grey, rough, CAMERA)
    assert seen.ids.tolist() == kept.tolist()
    assert seen.note == "a layout"
    assert np.abs(off(seen, truth)).max() < 0.04
