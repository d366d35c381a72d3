"""Clutter and light leave the discs of the plate as they are drawn."""

import numpy as np
import pytest

from handeye_cli.geometry import rotations, se3
from handeye_cli.records import Camera
from handeye_cli.simulate.random_views import random_view
from handeye_cli.simulate.render import Appearance, paint_target
from handeye_cli.simulate.scenery import Scenery, render_scene
from handeye_cli.targets.drawing import Drawing, checkers

CAMERA = Camera(160, 120, 180.0, 180.0, 79.0, 60.5, (-0.2, 0.05, 0.001, -0.001, 0.0))
CENTRES = 0.01 * np.array([[x, y, 0.0] for y in range(3) for x in range(3)])
RADII = np.full(9, 0.003)
POSE = se3.from_parts(rotations.exp(np.array([0.3, -0.2, 0.4])), np.array([-0.01, -0.009, 0.12]))
LOOK = Appearance(background=100.0)
DISCS = np.column_stack([CENTRES[:, :2], RADII])
PAPER = Drawing(DISCS)
PLATE = Drawing(DISCS, outline=np.array([[-0.008, -0.008], [0.028, 0.028]]))


def scene(drawing=PAPER, seed=0, **more):
    rng = np.random.default_rng(seed)
    scenery = Scenery(**more)
    picture = render_scene(CAMERA, POSE, drawing, scenery=scenery, rng=rng, appearance=LOOK)
    return picture.astype(float)


def plain(drawing=PAPER):
    return paint_target(CAMERA, POSE, drawing, appearance=LOOK)


@pytest.mark.parametrize("drawing", [PAPER, PLATE])
def test_without_anything_around_it_is_the_plain_picture(drawing):
    np.testing.assert_allclose(scene(drawing), plain(drawing), atol=0.51)


def test_clutter_lies_beside_the_grid():
    before = scene()
    after = scene(blobs=30, decoys=30, seed=4)
    changed = np.abs(after - before) > 1.0
    assert changed.mean() > 0.02
    v, u = np.nonzero(before < 0.6 * LOOK.paper)
    assert not changed[v, u].any()


def test_clutter_keeps_off_the_squares_of_a_chessboard():
    squares = checkers(5, 4, 0.005) - 0.002
    board = Drawing(rectangles=squares)
    before, after = scene(board), scene(board, blobs=30, decoys=30, seed=4)
    changed = np.abs(after - before) > 1.0
    assert changed.mean() > 0.02
    assert not changed[before < 0.9 * LOOK.paper].any()


def test_a_texture_has_its_spread_and_leaves_the_plate_alone():
    drawn = scene(PLATE, texture=20.0, grain_px=1.0)
    inside = plain(PLATE) > 0.99 * LOOK.paper
    assert np.abs(drawn[inside] - LOOK.paper).max() < 6.0
    outside = np.abs(plain(PLATE) - LOOK.background) < 0.1
    assert np.std(drawn[outside]) == pytest.approx(20.0, rel=0.1)


def test_a_shadow_takes_its_share_and_is_half_in_the_middle_of_the_plate():
    ratio = scene(shadow=0.5, shadow_px=4.0, shadow_angle=0.0) / scene()
    middle = np.mean(scene(decoys=0) < 0.6 * LOOK.paper, axis=0)
    column = int(np.rint(np.average(np.arange(160), weights=middle)))
    assert ratio[:, :20].mean() == pytest.approx(1.0, abs=0.02)
    assert ratio[:, -20:].mean() == pytest.approx(0.5, abs=0.02)
    assert np.abs(np.median(ratio[:, column]) - 0.75) < 0.1


@pytest.mark.parametrize("seed", range(3))
def test_random_views_repeat_and_know_their_discs(seed):
    camera = Camera(320, 240, 300.0, 300.0, 160.0, 120.0, (-0.2, 0.05, 0.0, 0.0, 0.0))
    views = [
        random_view(camera, CENTRES, RADII, np.random.default_rng(seed), width_px=(12.0, 40.0))
        for _ in range(2)
    ]
    np.testing.assert_array_equal(views[0].image, views[1].image)
    exact = paint_target(camera, views[0].camera_T_target, PAPER)
    darkness = (exact.max() - exact) / np.ptp(exact)
    for middle in views[0].ellipses:
        around = int(0.5 * views[0].width) + 3
        u, v = np.rint(middle).astype(int)
        part = darkness[v - around : v + around + 1, u - around : u + around + 1]
        rows, columns = np.indices(part.shape)
        # a neighbour may reach into the corners of the part
        part = np.where(np.hypot(rows - around, columns - around) < around, part, 0.0)
        grey = np.array([np.sum(part * columns), np.sum(part * rows)]) / part.sum()
        np.testing.assert_allclose(grey + np.array([u - around, v - around]), middle, atol=0.25)
    assert np.linalg.norm(views[0].ellipses - views[0].discs, axis=1).max() < 2.0
