"""Discs beside those of a layout: which of them tell that the plate is another one."""

from __future__ import annotations

import numpy as np
import pytest

from handeye_cli import targets
from handeye_cli.geometry import rotations, se3
from handeye_cli.records import Camera
from handeye_cli.simulate.render import Appearance, render_target
from handeye_cli.targets.disc_spots import Spots
from handeye_cli.targets.disc_strangers import Strangers, strangers

PITCH, RADIUS = 20.0, 6.0
LAYOUT = np.argwhere(np.ones((5, 4)))
HALF = np.array([0.5, 0.5])
CAMERA = Camera(640, 480, 600.0, 600.0, 320.0, 240.0, (-0.1, 0.02, 0.0, 0.0, 0.0))


def among(places, radius=RADIUS):
    """What is said of a layout that is seen among spots at these places, in a tilted view."""
    view = np.array([[PITCH, 3.0], [-2.0, 0.7 * PITCH]])
    spots = np.concatenate([LAYOUT, np.reshape(places, (-1, 2))])
    radii = np.full(len(spots), RADIUS)
    radii[len(LAYOUT) :] = radius
    shapes = radii[:, None, None] / PITCH * view
    seen = Spots(spots @ view.T + 100.0, shapes)
    return strangers(seen, LAYOUT @ view.T + 100.0, np.tile(view, (len(LAYOUT), 1, 1)), LAYOUT)


def test_a_layout_alone_has_no_strangers():
    assert among([]) == Strangers(0, 0)


@pytest.mark.parametrize(("count", "told"), [(2, 0), (3, 3), (6, 6)])
def test_discs_between_others_are_counted_when_they_are_several(count, told):
    assert among(LAYOUT[:count] + HALF) == Strangers(told, 0)


def test_a_row_more_is_counted_when_it_is_most_of_one():
    row = np.stack([np.full(4, 5), np.arange(4)], axis=1)
    assert among(row) == Strangers(0, 4)
    assert among(row[:2]) == Strangers(0, 0)


@pytest.mark.parametrize("radius", [0.7 * RADIUS, 1.4 * RADIUS])
def test_spots_of_another_size_are_no_discs(radius):
    assert among(LAYOUT[:8] + HALF, radius) == Strangers(0, 0)


def test_clutter_beside_a_plate_is_no_row():
    rng = np.random.default_rng(1)
    away = rng.uniform(-6.0, 12.0, (300, 2))
    outside = np.any((away < -1.3) | (away > [5.3, 4.3]), axis=1)
    assert among(away[outside]) == Strangers(0, 0)


@pytest.mark.parametrize(("tilt", "square_px"), [(20.0, 18.0), (45.0, 30.0), (0.0, 60.0)])
def test_squares_of_a_chessboard_are_no_discs(tilt, square_px):
    """Its black squares lie as the discs of a pattern of circles do."""
    board = targets.build(targets.parse("chessboard:6x4:10mm"))
    middle = board.points().mean(axis=0)
    R = rotations.exp(np.radians([tilt, 0.0, 0.0]))
    pose = se3.from_parts(R, np.array([0.0, 0.0, CAMERA.fx * 0.01 / square_px]) - R @ middle)
    rng = np.random.default_rng(3)
    look = Appearance(noise=1.0, blur_px=0.9)
    grey = render_target(CAMERA, pose, board.drawing(), appearance=look, rng=rng)
    for declared in ("asymmetric-circles:3x5:10mm:10mm", "asymmetric-circles:2x3:10mm:10mm"):
        assert targets.build(targets.parse(declared)).detect(grey).reason is not None
