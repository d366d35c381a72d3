"""Corners of chessboards and ChArUco boards in drawn pictures, against where they truly are."""

from __future__ import annotations

import numpy as np
import pytest

from handeye_cli import targets
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.records import Camera
from handeye_cli.simulate.render import Appearance, render_target

CAMERA = Camera(640, 520, 700.0, 698.0, 322.0, 257.0, (-0.2, 0.05, 1e-3, -1e-3, 0.0))
CHESSBOARD = "chessboard:7x5:10mm"
CHARUCO = "charuco:6x5:10mm:7mm:DICT_4X4_50:legacy=false"


def look(text, tilt_deg, square_px, rng, noise=2.0, **levels):
    """The board, a picture of it, and the true pixels of its corners."""
    board = targets.build(targets.parse(text))
    centre = board.points().mean(axis=0)
    about = rng.uniform(0, 2 * np.pi)
    tilt = np.radians(tilt_deg) * np.array([np.cos(about), np.sin(about), 0.0])
    R = rotations.exp(tilt) @ rotations.exp(np.array([0.0, 0.0, rng.uniform(-0.4, 0.4)]))
    away = np.array([0.0, 0.0, CAMERA.fx * 0.01 / square_px])
    pose = se3.from_parts(R, away - R @ centre)
    light = Appearance(**{"gradient": (0.2, -0.1), "noise": noise, **levels})
    grey = render_target(CAMERA, pose, board.drawing(), appearance=light, rng=rng)
    return board, grey, project(se3.transform_points(pose, board.points()), CAMERA.parameters)


def errors(board, seen, truth):
    turns = [truth[turn][seen.ids] - seen.pixels for turn in board.turns()]
    return min(turns, key=lambda off: np.abs(off).max())


@pytest.mark.parametrize(
    ("text", "tilt_deg"),
    [(CHESSBOARD, 0.0), (CHESSBOARD, 25.0), (CHESSBOARD, 55.0), (CHARUCO, 25.0)],
)
def test_corners_are_known_to_a_hundredth_of_a_pixel_and_the_noise_is_honest(text, tilt_deg):
    rng = np.random.default_rng(int(tilt_deg))
    squares, sigmas = [], []
    for _ in range(3 if text == CHESSBOARD else 4):
        board, grey, truth = look(text, tilt_deg, 32.0, rng)
        rough = board.detect(grey)
        seen = board.refine(grey, rough, CAMERA)
        assert seen.reason is None
        assert len(seen.ids) == len(rough.ids)
        squares.append(np.mean(errors(board, seen, truth) ** 2))
        sigmas.append(seen.sigma_px**2)
    assert np.sqrt(np.mean(squares)) < 0.012
    # 160 or more coordinates know their RMS within 6 %; a little bias comes on top
    assert np.sqrt(np.mean(squares)) == pytest.approx(np.sqrt(np.mean(sigmas)), rel=0.25)


@pytest.mark.parametrize(
    ("text", "levels"),
    [
        (CHESSBOARD, {"paper": 330.0, "gradient": (0.5, 0.3)}),
        (CHARUCO, {"paper": 300.0, "gradient": (0.8, 0.0)}),
        (CHESSBOARD, {"ink": -25.0, "gradient": (0.5, 0.3)}),
    ],
    ids=["white", "half white", "black"],
)
def test_light_that_the_sensor_clips_neither_draws_the_corners_nor_hides_their_noise(text, levels):
    """Without the clipped model the error is 0.009 px, and 1.5 times what is said of it."""
    rng = np.random.default_rng(5)
    squares, sigmas = [], []
    for tilt in (10.0, 30.0, 50.0):
        board, grey, truth = look(text, tilt, 30.0, rng, **levels)
        assert np.mean((grey == 0) | (grey == 255)) > 0.01
        seen = board.refine(grey, board.detect(grey), CAMERA)
        squares.append(np.mean(errors(board, seen, truth) ** 2))
        sigmas.append(seen.sigma_px**2)
    assert np.sqrt(np.mean(squares)) < 0.006
    # 120 or more coordinates know their RMS within 7 %
    assert np.sqrt(np.mean(squares)) == pytest.approx(np.sqrt(np.mean(sigmas)), rel=0.22)


@pytest.mark.parametrize("square_px", [14.0, 60.0])
def test_windows_follow_the_squares(square_px):
    """A window of 11 pixels would reach into the next corner of small squares."""
    rng = np.random.default_rng(3)
    board, grey, truth = look(CHESSBOARD, 20.0, square_px, rng)
    seen = board.refine(grey, board.detect(grey), CAMERA)
    assert np.sqrt(np.mean(errors(board, seen, truth) ** 2)) < 0.02


def test_without_noise_there_is_no_bias():
    rng = np.random.default_rng(5)
    board, grey, truth = look(CHESSBOARD, 40.0, 30.0, rng, noise=0.0)
    seen = board.refine(grey, board.detect(grey), CAMERA)
    assert np.sqrt(np.mean(errors(board, seen, truth) ** 2)) < 0.003


def test_without_intrinsics_corners_are_as_good():
    rng = np.random.default_rng(7)
    board, grey, truth = look(CHESSBOARD, 30.0, 30.0, rng)
    seen = board.refine(grey, board.detect(grey), None)
    assert np.sqrt(np.mean(errors(board, seen, truth) ** 2)) < 0.012


def test_a_covered_corner_is_left_out():
    rng = np.random.default_rng(9)
    board, grey, truth = look(CHESSBOARD, 10.0, 34.0, rng)
    rough = board.detect(grey)
    order = min(board.turns(), key=lambda turn: np.abs(truth[turn] - rough.pixels).max())
    u, v = np.rint(truth[order][17]).astype(int)
    grey[v - 9 : v + 10, u - 9 : u + 2] = 120
    seen = board.refine(grey, rough, CAMERA)
    assert 17 not in seen.ids
    assert len(seen.ids) >= len(truth) - 3
    assert np.sqrt(np.mean(errors(board, seen, truth) ** 2)) < 0.03
