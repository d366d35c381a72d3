"""Discs found and then measured through the camera, in drawn pictures with known truth."""

from __future__ import annotations

import numpy as np
import pytest

from handeye_cli import targets
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.records import Camera
from handeye_cli.simulate.render import Appearance, render_target
from handeye_cli.targets.drawing import Drawing

CAMERA = Camera(640, 480, 700.0, 700.0, 321.0, 239.0, (-0.2, 0.05, 1e-3, -1e-3, 0.0))
PLAIN = "disc-grid:6x6:5mm:4mm"
CORNER = "disc-grid:10x10:5mm:2.5mm:5mm"


def picture(text, rng, tilt_deg, noise=2.0, **look):
    """A drawn picture of a target with the pixels of its points."""
    board = targets.build(targets.parse(text))
    centre = board.points().mean(axis=0)
    across = rng.uniform(0, 2 * np.pi)
    tilt = np.radians(tilt_deg) * np.array([np.cos(across), np.sin(across), 0.0])
    R = rotations.exp(tilt) @ rotations.exp(np.array([0, 0, rng.uniform(-3, 3)]))
    distance = 1.7 * CAMERA.fx * np.ptp(board.points()[:, 0]) / CAMERA.height
    pose = se3.from_parts(R, np.array([0.0, 0.0, distance]) - R @ centre)
    light = Appearance(**{"gradient": (0.2, -0.1), "noise": noise, **look})
    grey = render_target(CAMERA, pose, board.drawing(), appearance=light, rng=rng)
    points = se3.transform_points(pose, board.points())
    return board, grey, project(points, CAMERA.parameters)


def numbered_like(seen, truth, board):
    """The truth in the turn that the detector picked."""
    turns = [truth[turn][seen.ids] for turn in board.turns()]
    return min(turns, key=lambda turn: np.abs(turn - seen.pixels).max())


@pytest.mark.parametrize("tilt_deg", [5.0, 50.0])
@pytest.mark.parametrize("text", [PLAIN, CORNER])
def test_centres_are_the_discs_and_the_noise_is_honest(text, tilt_deg):
    rng = np.random.default_rng(int(tilt_deg))
    squares, sigmas = [], []
    for _ in range(2):
        board, grey, truth = picture(text, rng, tilt_deg)
        seen = board.refine(grey, board.detect(grey), CAMERA)
        assert len(seen.ids) == len(truth)
        squares.append((seen.pixels - numbered_like(seen, truth, board)) ** 2)
        sigmas.append(seen.sigma_px)
    rms = np.sqrt(np.mean(squares))
    assert rms < 0.015
    # the mean of 144 or 400 squares is known within 12 % or 7 %; bias takes a little more
    assert np.sqrt(np.mean(np.square(sigmas))) == pytest.approx(rms, rel=0.2)


def test_it_is_ten_times_nearer_than_the_rough_centres():
    rng = np.random.default_rng(5)
    board, grey, truth = picture(PLAIN, rng, 45.0)
    rough = board.detect(grey)
    fine = board.refine(grey, rough, CAMERA)
    before = np.sqrt(np.mean((rough.pixels - numbered_like(rough, truth, board)) ** 2))
    after = np.sqrt(np.mean((fine.pixels - numbered_like(fine, truth, board)) ** 2))
    assert after < 0.1 * before


def test_without_a_camera_a_plane_without_distortion_is_assumed():
    rng = np.random.default_rng(7)
    board, grey, truth = picture(PLAIN, rng, 30.0)
    seen = board.refine(grey, board.detect(grey), None)
    assert np.abs(seen.pixels - numbered_like(seen, truth, board)).max() < 0.15


def test_a_covered_disc_is_left_out():
    rng = np.random.default_rng(11)
    board, grey, truth = picture(CORNER, rng, 10.0)
    rough = board.detect(grey)
    u, v = np.rint(truth[55]).astype(int)
    grey[v - 12 : v + 1, u - 12 : u + 13] = 150
    seen = board.refine(grey, rough, CAMERA)
    assert 55 not in seen.ids
    assert len(seen.ids) == 99
    apart = seen.pixels - numbered_like(seen, truth, board)
    assert np.abs(apart).max() < 0.05


def test_what_was_not_found_stays_so():
    board = targets.build(targets.parse(PLAIN))
    blank = np.full((480, 640), 128, dtype=np.uint8)
    missing = board.detect(blank)
    assert board.refine(blank, missing, CAMERA) is missing


def test_blank_paper_under_the_rough_centres_gives_a_reason():
    rng = np.random.default_rng(13)
    board, grey, _ = picture(PLAIN, rng, 10.0)
    rough = board.detect(grey)
    noise = np.clip(rng.normal(128, 20, grey.shape), 0, 255).astype(np.uint8)
    seen = board.refine(noise, rough, CAMERA)
    assert seen.reason is not None
    assert "too blurred or too faint" in seen.reason


def test_large_tilted_discs_start_from_their_centres():
    """Discs of 90 px at 50 deg: middles and centres lie more than a pixel apart."""
    camera = Camera(900, 700, 900.0, 900.0, 449.5, 349.5)
    board = targets.build(targets.parse("disc-grid:3x3:20mm:16mm"))
    R = rotations.exp(np.radians(50.0) * np.array([0.6, 0.8, 0.0]))
    pose = se3.from_parts(R, np.array([0.0, 0.0, 0.14]) - R @ board.points().mean(axis=0))
    grey = render_target(camera, pose, Drawing(board.drawing().discs))
    rough = board.detect(grey)
    seen = board.refine(grey, rough, camera)
    truth = project(se3.transform_points(pose, board.points()), camera.parameters)
    assert np.abs(rough.pixels - numbered_like(rough, truth, board)).max() > 1.0
    assert len(seen.ids) == 9
    assert np.abs(seen.pixels - numbered_like(seen, truth, board)).max() < 0.01


def test_paper_that_is_white_on_one_side_leaves_the_noise_honest():
    """Of 72 numbers of each of four pictures the RMS is known within 5 %; a fifth is allowed."""
    rng = np.random.default_rng(17)
    squares, sigmas = [], []
    for tilt_deg in (5.0, 20.0, 35.0, 50.0):
        board, grey, truth = picture(PLAIN, rng, tilt_deg, paper=245.0, gradient=(0.7, 0.2))
        assert 0.03 < np.mean(grey == 255) < 0.6
        seen = board.refine(grey, board.detect(grey), CAMERA)
        assert len(seen.ids) == 36
        squares.append((seen.pixels - numbered_like(seen, truth, board)) ** 2)
        sigmas.append(seen.sigma_px)
    assert np.sqrt(np.mean(np.square(sigmas))) == pytest.approx(np.sqrt(np.mean(squares)), rel=0.2)
