"""The fit of chessboard corners against pictures drawn with known truth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from handeye_cli import targets
from handeye_cli.geometry import corner_fit, rotations, se3
from handeye_cli.geometry.blurred_edge import crossing, normal_distribution
from handeye_cli.geometry.camera import project
from handeye_cli.geometry.corner_fit import fit_corners
from handeye_cli.geometry.corner_pixels import corner_pixels, crossings
from handeye_cli.records import Camera
from handeye_cli.simulate.render import Appearance, expose, paint_target

CAMERA = Camera(480, 400, 620.0, 615.0, 240.0, 200.0, (-0.2, 0.05, 1e-3, -1e-3, 0.0))
SQUARE = 5e-3
BOARD = targets.build(targets.parse("chessboard:6x5:5mm"))
CORNERS = BOARD.points()[:, :2]
CENTRAL = 0.11
"""Distance in metres at which a square is 28 pixels wide."""


@dataclass(frozen=True)
class View:
    """A pose of a board with the truth of its picture."""

    pose: np.ndarray
    board: targets.Board = BOARD

    @classmethod
    def at(cls, rng, tilt_deg, distance=CENTRAL, board=BOARD):
        across = rng.uniform(0, 2 * np.pi)
        tilt = np.radians(tilt_deg) * np.array([np.cos(across), np.sin(across), 0.0])
        R = rotations.exp(tilt) @ rotations.exp(np.array([0, 0, rng.uniform(-3, 3)]))
        middle = R @ board.points().mean(axis=0)
        aside = distance * rng.uniform(-0.05, 0.05, 2)
        return cls(se3.from_parts(R, np.append(aside, distance) - middle), board)

    def moved(self, x, y):
        return replace(self, pose=self.pose @ se3.from_parts(np.eye(3), np.array([x, y, 0.0])))

    def to_pixel(self, plate):
        here = plate @ self.pose[:3, :2].T + self.pose[:3, 3]
        return project(here, CAMERA.parameters)

    @property
    def corners(self):
        return self.board.points()[:, :2]

    @property
    def truth(self):
        return self.to_pixel(self.corners)

    def light(self, drawing=None, **look):
        appearance = Appearance(**{"gradient": (0.2, 0.1), **look})
        drawn = self.board.drawing() if drawing is None else drawing
        return paint_target(CAMERA, self.pose, drawn, appearance=appearance)

    def fit(self, rng, picture, gap=None):
        start = self.truth + rng.normal(scale=0.2, size=self.truth.shape)
        return fit_corners(picture, self.corners, SQUARE, self.to_pixel, start, gap=gap)


def rms(fit, view):
    return float(np.sqrt(np.mean((fit.pixels - view.truth) ** 2)))


@pytest.mark.parametrize("tilt_deg", [0.0, 20.0, 40.0, 55.0])
def test_corners_have_the_errors_that_the_noise_leaves(tilt_deg):
    """Chi-square of 2 per corner over 120 corners, and the noise of the pixels, both two-sided."""
    rng = np.random.default_rng(int(tilt_deg))
    squares, noise, errors = [], [], []
    for _ in range(4):
        view = View.at(rng, tilt_deg)
        fit = view.fit(rng, expose(view.light(), 2.0, rng))
        error = fit.pixels - view.truth
        squares.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(fit.covariance), error))
        noise.append(fit.noise)
        errors.append(rms(fit, view))
    # the slope of the light that corners share adds an error in common, and a tenth to the spread
    assert np.mean(squares) == pytest.approx(2.0, abs=4 * 2 / np.sqrt(120) + 0.2)
    # rounding to whole grey levels adds 1 / 12
    assert np.mean(noise) == pytest.approx(np.sqrt(4 + 1 / 12), rel=0.04)
    assert max(errors) < 0.012


def corner_bound(view, noise):
    """The least covariances of the corners, (n, 2, 2), by moving the drawn board."""
    step = 0.01 * SQUARE
    ways = ((step, 0.0), (0.0, step))
    slopes = [(view.moved(x, y).light() - view.moved(-x, -y).light()) / 2 for x, y in ways]
    rows, columns = np.mgrid[: CAMERA.height, : CAMERA.width]
    pixels = np.stack([columns, rows], axis=-1).reshape(-1, 1, 2).astype(float)
    plane, _ = cv2.findHomography(view.truth, view.corners / SQUARE)
    place = cv2.perspectiveTransform(pixels, plane)[:, 0]
    ends = [view.moved(x, y).truth - view.moved(-x, -y).truth for x, y in ways]
    by_plate = np.stack(ends, axis=-1) / 2
    bounds = []
    for corner, jacobian in zip(view.corners / SQUARE, by_plate, strict=True):
        own = np.abs(place - corner).max(axis=1) < 0.5
        x, y = (slope.ravel()[own] for slope in slopes)
        information = np.array([[x @ x, x @ y], [x @ y, y @ y]])
        bounds.append(jacobian @ np.linalg.inv(information) @ jacobian.T)
    return (noise**2 + 1 / 12) * np.array(bounds)


@pytest.mark.parametrize("tilt_deg", [10.0, 50.0])
def test_it_is_near_the_cramer_rao_bound(tilt_deg):
    """All else being known, and with all pixels of the squares, no estimate is better."""
    rng = np.random.default_rng(3)
    view = View.at(rng, tilt_deg)
    bound = np.trace(corner_bound(view, 2.0), axis1=1, axis2=2)
    light, squares, promised = view.light(), [], []
    for _ in range(8):
        fit = view.fit(rng, expose(light, 2.0, rng))
        squares.append(np.sum((fit.pixels - view.truth) ** 2, axis=1))
        promised.append(np.trace(fit.covariance, axis1=1, axis2=2))
    # 480 squares are known within 7 %; the windows leave out a tenth of the edges
    assert 0.9 < np.sqrt(np.mean(squares) / np.mean(bound)) < 1.2
    assert 1.0 < np.sqrt(np.mean(promised) / np.mean(bound)) < 1.2


@pytest.mark.parametrize("tilt_deg", [0.0, 20.0, 40.0, 55.0])
def test_without_noise_the_corner_is_exact(tilt_deg):
    rng = np.random.default_rng(50 + int(tilt_deg))
    view = View.at(rng, tilt_deg)
    fit = view.fit(rng, expose(view.light(), 0.0, None))
    assert rms(fit, view) < 0.002
    assert fit.blur == pytest.approx(np.sqrt(0.7**2 + 1 / 12), rel=0.05)


@pytest.mark.parametrize("width", [8, 14, 50, 100])
def test_squares_of_any_size(width):
    rng = np.random.default_rng(7)
    view = View.at(rng, 30.0, 620.0 * SQUARE / width)
    inside = np.all((view.truth > 10) & (view.truth < [469, 389]), axis=1)
    exact = view.fit(rng, expose(view.light(), 0.0, None))
    assert np.sqrt(np.mean((exact.pixels - view.truth)[inside] ** 2)) < 0.003
    noisy = view.fit(rng, expose(view.light(), 2.0, rng))
    sigma = np.sqrt(np.mean(np.trace(noisy.covariance[inside], axis1=1, axis2=2)) / 2)
    error = np.sqrt(np.mean((noisy.pixels - view.truth)[inside] ** 2))
    assert error == pytest.approx(sigma, rel=3 / np.sqrt(4 * inside.sum()) + 0.1)
    assert error < 0.14 / np.sqrt(width) ** 1.8 + 0.004


@pytest.mark.parametrize(
    "look",
    [
        {"blur_px": 0.4},
        {"blur_px": 1.5},
        {"gradient": (0.5, -0.4)},
        {"ink": 205.0, "paper": 35.0},
        {"ink": 100.0, "paper": 160.0},
    ],
)
def test_light_and_lens_may_vary(look):
    rng = np.random.default_rng(11)
    view = View.at(rng, 35.0)
    fit = view.fit(rng, expose(view.light(**look), 0.0, None))
    assert rms(fit, view) < 0.004
    expected = look.get("paper", 205.0) - look.get("ink", 35.0)
    even = np.arange(len(CORNERS)) % 6 + np.arange(len(CORNERS)) // 6
    contrast = fit.contrast * np.where(even % 2 == 0, 1, -1)
    assert np.median(contrast) == pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize("gamma", [0.45, 2.2])
def test_the_camera_need_not_be_linear(gamma):
    rng = np.random.default_rng(12)
    view = View.at(rng, 35.0)
    fit = view.fit(rng, expose(255 * (view.light() / 255) ** gamma, 0.0, None))
    assert rms(fit, view) < 0.003


@pytest.mark.parametrize("grown", [2.5e-4, -2.5e-4])
def test_ink_may_spread(grown):
    """Squares that are too large by a third of a pixel on each side leave the corners in place."""
    rng = np.random.default_rng(13)
    view = View.at(rng, 20.0)
    drawing = BOARD.drawing()
    wider = drawing.rectangles + 0.2 * grown * np.array([-1, -1, 1, 1])
    fit = view.fit(rng, expose(view.light(replace(drawing, rectangles=wider)), 0.0, None))
    assert rms(fit, view) < 0.003


def test_a_covered_corner_stands_out_and_leaves_the_others_alone():
    rng = np.random.default_rng(19)
    view = View.at(rng, 10.0)
    picture = expose(view.light(), 2.0, rng)
    u, v = np.rint(view.truth[14]).astype(int)
    picture[v - 12 : v + 1, u - 12 : u + 13] = 120
    fit = view.fit(rng, picture)
    assert fit.misfit[14] > 50.0
    others = np.delete(np.arange(len(CORNERS)), 14)
    assert np.sqrt(np.mean((fit.pixels - view.truth)[others] ** 2)) < 0.01


def test_a_corner_at_the_images_edge_uses_what_is_there():
    rng = np.random.default_rng(23)
    view = View(se3.from_parts(np.eye(3), np.array([-0.0436, -0.01, CENTRAL])))
    fit = view.fit(rng, expose(view.light(), 2.0, rng))
    assert np.all(np.isfinite(fit.pixels))
    cut = view.truth[:, 0] < 8
    assert cut.any()
    spread = np.sqrt(np.trace(fit.covariance, axis1=1, axis2=2))
    assert spread[cut].min() > spread[~cut].max()
    assert np.all(np.linalg.norm(fit.pixels - view.truth, axis=1) < 5 * spread)


def test_the_first_guess_may_be_a_pixel_off():
    rng = np.random.default_rng(29)
    view = View.at(rng, 25.0)
    picture = expose(view.light(), 2.0, rng)
    near = view.fit(rng, picture)
    away = fit_corners(picture, CORNERS, SQUARE, view.to_pixel, view.truth + 0.9)
    assert np.max(np.abs(away.pixels - near.pixels)) < 0.004


@pytest.mark.parametrize("marker", [2.5, 3.5, 4.0])
def test_what_is_printed_in_the_light_squares_is_left_out(marker):
    board = targets.build(targets.parse(f"charuco:6x5:5mm:{marker}mm:DICT_4X4_50"))
    rng = np.random.default_rng(31)
    view = View.at(rng, 25.0, board=board)
    picture = expose(view.light(), 0.0, None)
    gap = 0.5e-3 * (5.0 - marker)
    assert rms(view.fit(rng, picture, gap), view) < 0.004
    noisy = view.fit(rng, expose(view.light(), 2.0, rng), gap)
    sigma = np.sqrt(np.mean(np.trace(noisy.covariance, axis1=1, axis2=2)) / 2)
    # 40 values are known within 11 %
    assert rms(noisy, view) == pytest.approx(sigma, rel=0.35)


def test_distances_follow_the_bent_edges():
    """Against the board's own lines, drawn finely through the camera's distortion."""
    rng = np.random.default_rng(37)
    view = View.at(rng, 30.0, 0.055)
    seen = crossings(CORNERS, SQUARE, view.to_pixel, view.truth)
    picture = np.zeros((CAMERA.height, CAMERA.width), dtype=np.uint8)
    pixels = corner_pixels(picture, seen, 4.0)
    # from the half widths that the offsets are measured in to pixels
    half = np.rint(view.truth[0, 0]) / pixels.middle[0, 0]
    along = np.linspace(-1.0, 1.0, 4001)[:, None] * SQUARE
    for k in (0, 17, 29):
        at = half * (pixels.middle[k] + pixels.offset[k].T)[pixels.weight[k] > 0]
        for axis, way in ((0, [0.0, 1.0]), (1, [1.0, 0.0])):
            line = view.to_pixel(CORNERS[k] + along * way)
            nearest = np.min(np.linalg.norm(at[:, None] - line, axis=-1), axis=1)
            ours = np.abs(pixels.distance[k, axis][pixels.weight[k] > 0])
            close = ours < 4.0
            assert np.max(np.abs(ours - nearest)[close]) < 0.01


@pytest.mark.parametrize("shear", [-0.5, 0.0, 0.3, 0.7])
def test_the_crossing_is_the_product_of_signs_under_a_round_blur(shear):
    h, k = (each.ravel() for each in np.meshgrid(np.linspace(-3, 3, 13), np.linspace(-3, 3, 13)))
    covariance = [[1.0, shear], [shear, 1.0]]
    both = multivariate_normal([0, 0], covariance).cdf(np.stack([h, k], axis=1))
    expected = 4 * both - 2 * norm.cdf(h) - 2 * norm.cdf(k) + 1
    value, _ = crossing(np.stack([h, k])[:, None], np.array([shear]), len(h))
    # the next term of the series bounds what is left out
    np.testing.assert_allclose(value[0], expected, atol=2e-4 + 0.2 * abs(shear) ** 5)


def test_derivatives_of_the_crossing():
    rng = np.random.default_rng(41)
    at, shear = rng.uniform(-3, 3, (2, 4, 50)), rng.uniform(-0.6, 0.6, 4)
    _, slopes = crossing(at, shear, 50)
    for axis in (0, 1):
        step = np.zeros((2, 1, 1))
        step[axis] = 1e-3
        change = crossing(at + step, shear, 50)[0] - crossing(at - step, shear, 50)[0]
        # the distribution function is an approximation, to 1e-7
        np.testing.assert_allclose(slopes[axis], change / 2e-3, atol=3e-4)


def test_the_distribution_function():
    x = np.linspace(-6, 6, 1001)
    value, density = normal_distribution(x.astype(np.float32))
    np.testing.assert_allclose(value, norm.cdf(x), atol=3e-7)
    np.testing.assert_allclose(density, norm.pdf(x), atol=3e-7)


def test_derivatives_of_the_model():
    rng = np.random.default_rng(43)
    view = View.at(rng, 40.0)
    seen = crossings(CORNERS, SQUARE, view.to_pixel, view.truth)
    pixels = corner_pixels(expose(view.light(), 0.0, None), seen, 4.0)
    n, m = pixels.grey.shape
    state = np.tile([0.2, -0.3, 0.8, 120.0, 5.0, -8.0, 0.6, 0.05], (n, 1))
    _, J = corner_fit._model(pixels, seen.shear, state, m)
    steps = np.array([0.02, 0.02, 0.02, 1.0, 1.0, 1.0, 0.02, 0.02])
    for k, step in enumerate(steps):
        ends = [
            corner_fit._model(pixels, seen.shear, state + sign * step * np.eye(8)[k], m)[0]
            for sign in (1, -1)
        ]
        difference = (ends[0] - ends[1]) / (2 * step)
        # third derivatives, and single precision of 120 grey levels
        np.testing.assert_allclose(J[:, k], difference, atol=2e-3 * np.abs(J[:, k]).max() + 2e-5)
