"""Pixel coverage: the share of a cell behind an edge, the blur's weights, the way to the plate."""

import math

import cv2
import numpy as np
import pytest

from handeye_cli.errors import InputError, UsageError
from handeye_cli.geometry import rotations, se3
from handeye_cli.records import Camera
from handeye_cli.simulate.bowed import FLAT, Bow
from handeye_cli.simulate.coverage import half_plane_share
from handeye_cli.simulate.pixel_blur import blur_weights
from handeye_cli.simulate.plate_view import interpolated, look, plate_rays

DISTORTED = Camera(640, 480, 550.0, 548.0, 322.0, 238.0, (-0.2, 0.06, 0.001, -0.0007, 0.01))
TILTED = se3.from_parts(rotations.exp(np.array([0.4, -0.3, 0.6])), np.array([-0.02, 0.01, 0.3]))


def test_share_against_counting_points():
    rng = np.random.default_rng(1)
    down, across, signed = rng.uniform(-1, 1, 50), rng.uniform(-1, 1, 50), rng.uniform(-1, 1, 50)
    grid = (np.arange(400) + 0.5) / 400 - 0.5
    values = (
        signed[:, None, None] + down[:, None, None] * grid[:, None] + across[:, None, None] * grid
    )
    counted = np.mean(values < 0, axis=(1, 2))
    # A straight edge misjudges at most the points of two rows of the 400.
    assert half_plane_share(signed, down, across) == pytest.approx(counted, abs=2 / 400)


@pytest.mark.parametrize(
    ("signed", "down", "across", "share"),
    [
        (0.0, 0.3, -0.7, 0.5),
        (0.25, 1.0, 0.0, 0.25),
        (-0.25, 0.0, 1.0, 0.75),
        (0.5, 0.5, 0.5, 0.0),
        (0.25, 0.5, 0.5, 0.125),
        (1e9, 1.0, 1.0, 0.0),
        (-1e9, 1.0, 1.0, 1.0),
        (1.0, 0.0, 0.0, 0.0),
        (-1.0, 0.0, 0.0, 1.0),
    ],
)
def test_share_by_hand(signed, down, across, share):
    found = half_plane_share(np.array(signed), np.array(down), np.array(across))
    assert found == pytest.approx(share, abs=1e-4)


@pytest.mark.parametrize("blur", [0.0, 0.3, 0.7, 2.0])
def test_blur_keeps_all_light_and_its_place(blur):
    weights = blur_weights(blur, 4)
    pixels = np.arange(len(weights)) - len(weights) // 2
    assert weights.sum(axis=0) * 4 == pytest.approx(np.ones(4), abs=3e-6)
    assert pixels @ weights.sum(axis=1) == pytest.approx(0.0, abs=1e-12)
    assert weights == pytest.approx(weights[::-1, ::-1], abs=1e-12)


@pytest.mark.parametrize("blur", [0.3, 0.7, 2.0])
def test_blur_has_the_variance_of_gaussian_and_pixel(blur):
    weights = blur_weights(blur, 4)
    pixels = np.arange(len(weights)) - len(weights) // 2
    centres = (np.arange(4) + 0.5) / 4 - 0.5
    variance = np.sum(weights * (pixels[:, None] - centres) ** 2)
    # Two of the cell's boxes, 1 / (12 * 16) each: one is left to the scene's averaging over cells.
    expected = blur**2 + 1 / 12 - 1 / (12 * 16)
    assert variance == pytest.approx(expected, rel=1e-4)


def test_plate_points_are_where_opencv_projects_from():
    rng = np.random.default_rng(2)
    plate = rng.uniform(-0.06, 0.06, (200, 2))
    K = np.array([[550.0, 0, 322.0], [0, 548.0, 238.0], [0, 0, 1]])
    pixels, _ = cv2.projectPoints(
        np.column_stack([plate, np.zeros(200)]),
        rotations.log(TILTED[:3, :3]),
        TILTED[:3, 3],
        K,
        np.array(DISTORTED.distortion),
    )
    rays = plate_rays(DISTORTED, TILTED, pixels[:, 0])
    assert FLAT.met(se3.inverse(TILTED)[:3, 3], rays) == pytest.approx(plate, abs=1e-12)


@pytest.mark.parametrize("bow", [FLAT, Bow(np.array([0.01, -0.005]), 3.0, -0.002)])
def test_the_map_between_knots_is_the_exact_one(bow):
    view = look(DISTORTED, TILTED, 0.7, bow)
    corner = np.array([[0.0, 1.5], [240.0, 247.0], [480.0, 487.25]])
    rows, columns = corner, corner + 0.3 * corner[:, :1]
    u, v = np.broadcast_arrays(columns[:, None, :], rows[:, :, None])
    rays = plate_rays(DISTORTED, TILTED, np.stack([u, v], axis=-1) - view.margin)
    exact = bow.met(view.origin, rays)
    off = np.linalg.norm(interpolated(view, rows, columns) - exact, axis=-1)
    pixel = view.reach[[0, 30, 60], [0, 39, 78], None, None] / 8
    # the first and the last lie on the image's corner, beyond the outermost knots
    assert np.all(off < [[[3e-5]], [[1e-6]], [[3e-5]]] * pixel)


@pytest.mark.parametrize("slope", [0.0, 3.0, -3.0])
def test_a_block_stays_within_its_reach(slope):
    view = look(DISTORTED, TILTED, 0.7, Bow(np.zeros(2), slope, 0.0))
    height, width = view.reach.shape
    edge = np.array([-0.5, 7.5])
    for row in range(0, height, 7):
        across = 8 * np.arange(width)[:, None] + edge
        corners = interpolated(view, np.tile(8 * row + edge, (width, 1)), across)
        off = np.linalg.norm(corners - view.knots[row, :, None, None], axis=-1)
        # of a bowed plate as far as pictures show it: down to ten degrees from its surface
        shown = view.bow.sines(view.origin, corners).min(axis=(1, 2)) > 0.17
        assert np.all((off < view.reach[row, :, None, None])[shown])


def test_rays_above_the_horizon_stay_finite():
    steep = se3.from_parts(rotations.exp(np.array([1.35, 0.0, 0.0])), np.array([0.0, 0.0, 0.3]))
    assert np.all(np.isfinite(look(DISTORTED, steep, 0.7).knots))


def test_camera_behind_the_plate_is_refused():
    behind = se3.from_parts(rotations.exp(np.array([math.pi, 0.0, 0.0])), np.array([0, 0, 0.25]))
    with pytest.raises(UsageError, match="found it 250 mm behind"):
        look(DISTORTED, behind, 0.7)


@pytest.mark.parametrize(("blur", "found"), [(-0.5, "found -0.5 px"), (math.nan, "found nan px")])
def test_impossible_blur_is_refused(blur, found):
    with pytest.raises(UsageError, match=found):
        look(DISTORTED, TILTED, blur)


def test_distortion_that_folds_is_refused_with_the_pixel():
    folded = Camera(640, 480, 300.0, 300.0, 320.0, 240.0, (-0.6, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(InputError, match=r"found none at pixel \(-0.5, -0.5\)"):
        look(folded, TILTED, 0.7)
