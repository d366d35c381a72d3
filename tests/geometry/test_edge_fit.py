"""The fit of dark squares against pictures drawn with known truth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from handeye_cli import targets
from handeye_cli.geometry import edge_fit, rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.geometry.edge_fit import fit_squares
from handeye_cli.geometry.edge_pixels import Squares, band_pixels, image_sides
from handeye_cli.records import Camera
from handeye_cli.simulate.render import Appearance, expose, paint_target
from handeye_cli.targets.drawing import Drawing

CAMERA = Camera(400, 380, 600.0, 595.0, 203.0, 188.0, (-0.25, 0.08, 1e-3, -1e-3, 0.0))
SIDE = 0.048
CELLS = 8
CORNERS = SIDE * np.array([[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]])
FULL_BLUR = np.sqrt(0.7**2 + 1 / 12)
"""Of the drawn blur and of the pixels, which integrate."""


@dataclass(frozen=True)
class View:
    """A tag of 8 x 8 cells seen by the camera, `width` pixels wide if it faced it."""

    pose: np.ndarray
    dark: np.ndarray

    @classmethod
    def at(cls, rng, tilt_deg, width, *, aside=0.2):
        across = rng.uniform(0, 2 * np.pi)
        tilt = np.radians(tilt_deg) * np.array([np.cos(across), np.sin(across), 0.0])
        R = rotations.exp(tilt) @ rotations.exp(np.array([0.0, 0.0, rng.uniform(-3, 3)]))
        distance = CAMERA.fx * SIDE / width
        room = max(0.0, 1.0 - 1.3 * width / CAMERA.height)
        offset = aside * room * distance * rng.uniform(-1, 1, 2)
        pose = se3.from_parts(R, np.append(offset, distance) - R @ np.append([SIDE / 2] * 2, 0.0))
        dark = np.ones((CELLS, CELLS), dtype=bool)
        dark[1:-1, 1:-1] = rng.random((CELLS - 2, CELLS - 2)) < 0.5
        return cls(pose, dark)

    def to_pixel(self, plate):
        points = np.concatenate([plate, np.zeros((*plate.shape[:-1], 1))], axis=-1)
        here = points @ self.pose[:3, :3].T + self.pose[:3, 3]
        return project(here, CAMERA.parameters)

    @property
    def truth(self):
        return self.to_pixel(CORNERS)

    @property
    def squares(self):
        light = ~self.dark[1:-1, 1:-1]
        sides = [light[0], light[:, -1], light[-1, ::-1], light[::-1, 0]]
        return Squares(CORNERS, CELLS, np.array([sides]), margin=1.0)

    def light(self, margin=2.0, **look):
        row, column = np.nonzero(self.dark)
        cell = SIDE / CELLS
        cells = cell * np.stack([column, row, column + 1, row + 1], axis=1)
        reach = margin * cell
        outline = np.array([[-reach, -reach], [SIDE + reach, SIDE + reach]])
        look = Appearance(**{"gradient": (0.3, 0.2), **look})
        drawing = Drawing(rectangles=cells, outline=outline)
        return paint_target(CAMERA, self.pose, drawing, appearance=look)

    def picture(self, rng=None, margin=2.0, noise=0.0, **look):
        return expose(self.light(margin, **look), noise, rng)

    def fit(self, rng, picture, off=0.5):
        start = self.truth + rng.normal(scale=off, size=self.truth.shape)
        return fit_squares(picture, self.squares, self.to_pixel, start)


def rms(fit, view):
    return float(np.sqrt(np.mean((fit.pixels - view.truth) ** 2)))


@pytest.mark.parametrize("width", [30, 90, 260])
@pytest.mark.parametrize("tilt_deg", [0.0, 40.0, 55.0])
def test_without_noise_corners_are_where_they_are(tilt_deg, width):
    """Light cells begin two to four pixels behind the edge of the small tag."""
    rng = np.random.default_rng([int(tilt_deg), width])
    for _ in range(2):
        view = View.at(rng, tilt_deg, width)
        fit = view.fit(rng, view.picture())
        assert rms(fit, view) < (0.012 if width == 30 else 0.0025)
        assert fit.blur == pytest.approx(FULL_BLUR, rel=0.15 if width == 30 else 0.03)


@pytest.mark.parametrize(("tilt_deg", "width"), [(10.0, 40), (45.0, 60), (55.0, 110), (30.0, 240)])
def test_corners_have_the_errors_that_the_noise_leaves(tilt_deg, width):
    """Chi-square of 2 per corner over 40 corners of 2 views, and the noise, both two-sided."""
    rng = np.random.default_rng([7, width])
    squares_, noise = [], []
    for _ in range(2):
        view = View.at(rng, tilt_deg, width)
        light = view.light()
        for _ in range(5):
            fit = view.fit(rng, expose(light, 3.0, rng))
            error = (fit.pixels - view.truth).reshape(-1, 2)
            weight = np.linalg.inv(fit.covariance.reshape(-1, 2, 2))
            squares_.append(np.einsum("ni,nij,nj->n", error, weight, error))
            noise.append(fit.noise)
    # corners of one tag share sides: an effective 30 of the 40
    assert np.mean(squares_) == pytest.approx(2.0, abs=4 * 2 / np.sqrt(30))
    # rounding to whole grey levels adds 1 / 12
    assert np.mean(noise) == pytest.approx(np.sqrt(9 + 1 / 12), rel=0.1)


def test_derivatives_are_those_of_the_model():
    rng = np.random.default_rng(11)
    view = View.at(rng, 35.0, 40)
    sides = image_sides(CORNERS, CELLS, view.to_pixel)
    band = band_pixels(view.picture(), view.squares, sides, np.full(4, 0.8), 4.0)
    assert band.cells is not None
    across = np.array([0.1, -0.2, 0.3, 0.0])
    state = np.tile([0.2, -0.3, 0.9, 180.0, 4.0, 0.2], (4, 1))
    _, J = edge_fit._model(band, state, across)
    seen = band.weight > 0
    for k, step in enumerate([0.02, 0.02, 0.02, 1.0, 1.0, 0.02]):
        ahead, behind = state.copy(), state.copy()
        ahead[:, k] += step
        behind[:, k] -= step
        levels = [edge_fit._model(band, each, across)[0] for each in (ahead, behind)]
        numeric = (levels[0] - levels[1]) / (2 * step)
        # The blur's part in what is behind the border along its row is left out: it is small.
        tolerance = 0.05 if k == 2 else 0.002
        error = np.abs(J[:, k] - numeric)[seen]
        assert error.max() < tolerance * np.abs(numeric[seen]).max()


def test_distances_are_those_to_the_bent_line():
    """Against the nearest of many points of the line's image."""
    rng = np.random.default_rng(13)
    view = View.at(rng, 50.0, 230)
    sides = image_sides(CORNERS, CELLS, view.to_pixel)
    picture = np.arange(CAMERA.width * CAMERA.height).reshape(CAMERA.height, CAMERA.width)
    bow = np.abs(np.polynomial.polynomial.polyval(0.5, sides.curve.T))
    assert bow.max() > 0.5
    # the grey levels tell the column, then the row
    band = band_pixels(picture % CAMERA.width, view.squares, sides, np.full(4, 0.8), 4.0)
    rows = band_pixels(picture // CAMERA.width, view.squares, sides, np.full(4, 0.8), 4.0)
    following = np.roll(CORNERS[0], -1, axis=0)
    shares = np.linspace(0, 1, 20001)[:, None]
    for k in range(4):
        line = view.to_pixel(CORNERS[0, k] + shares * (following[k] - CORNERS[0, k]))
        chosen = rng.choice(np.flatnonzero(band.weight[k]), 40)
        pixels = np.stack([band.grey[k], rows.grey[k]], axis=1)[chosen]
        nearest = np.linalg.norm(pixels[:, None] - line, axis=-1).min(axis=1)
        np.testing.assert_allclose(np.abs(band.distance[k, chosen]), nearest, atol=2e-3)


@pytest.mark.parametrize("off", [1.0, -1.2])
def test_the_start_may_be_a_pixel_or_two_off(off):
    rng = np.random.default_rng(17)
    view = View.at(rng, 30.0, 80)
    picture = view.picture(rng, noise=2.0)
    near = view.fit(rng, picture)
    outward = np.sign(view.truth - view.truth.mean(axis=1, keepdims=True))
    away = fit_squares(picture, view.squares, view.to_pixel, view.truth + off * outward)
    assert np.max(np.abs(away.pixels - near.pixels)) < 0.003


@pytest.mark.parametrize("width", [35, 150])
def test_the_maps_attitude_does_not_matter(width):
    """The start leads to other points of a plate seen from elsewhere, but to the same corners."""
    rng = np.random.default_rng(19)
    view = View.at(rng, 30.0, width)
    turn = se3.from_parts(rotations.exp(np.array([0.1, -0.15, 0.0])), np.zeros(3))
    other = replace(view, pose=view.pose @ turn)
    picture = view.picture(rng, noise=2.0)
    right = fit_squares(picture, view.squares, view.to_pixel, view.truth)
    wrong = fit_squares(picture, view.squares, other.to_pixel, view.truth)
    assert np.max(np.abs(other.truth - view.truth)) > 1.0
    assert np.max(np.abs(right.pixels - wrong.pixels)) < 0.002


@pytest.mark.parametrize(
    "look",
    [
        {"blur_px": 0.4},
        {"blur_px": 2.0},
        {"gradient": (1.2, -0.8)},
        {"ink": 90.0, "paper": 150.0},
        {"background": 10.0, "margin": 1.0},
    ],
)
def test_light_and_lens_may_vary(look):
    rng = np.random.default_rng(23)
    view = View.at(rng, 35.0, 90)
    fit = view.fit(rng, view.picture(**look))
    assert rms(fit, view) < 0.006
    expected = look.get("paper", 205.0) - look.get("ink", 35.0)
    assert np.median(fit.contrast) == pytest.approx(expected, rel=0.15)


def test_a_light_square_has_negative_contrast():
    rng = np.random.default_rng(29)
    view = View.at(rng, 15.0, 80)
    fit = view.fit(rng, 255 - view.picture())
    assert np.all(fit.contrast < -100)


def test_a_covered_side_stands_out():
    rng = np.random.default_rng(31)
    view = View.at(rng, 10.0, 120)
    picture = view.picture(rng, noise=2.0)
    clean = view.fit(rng, picture)
    assert clean.misfit.max() < 2.0 * clean.noise**2
    u, v = np.rint(view.truth[0, :2].mean(axis=0)).astype(int)
    picture[v - 12 : v + 13, u - 12 : u + 13] = 130
    fit = view.fit(rng, picture)
    assert np.argmax(fit.misfit) == 0
    assert fit.misfit[0, 0] > 50 * fit.noise**2
    assert np.max(np.abs(fit.pixels - view.truth)[0, 2:]) < 0.02


def test_a_square_outside_of_the_image_has_no_certainty():
    rng = np.random.default_rng(41)
    view = View.at(rng, 10.0, 100)
    corners = np.concatenate([CORNERS, CORNERS + np.array([0.3, 0.0])])
    two = replace(view.squares, corners=corners, light=np.tile(view.squares.light, (2, 1, 1)))
    fit = fit_squares(view.picture(rng, noise=2.0), two, view.to_pixel, view.to_pixel(corners))
    spread = np.sqrt(np.trace(fit.covariance, axis1=-2, axis2=-1))
    assert np.all(spread[0] < 0.02)
    assert np.all(spread[1] > 1e3)
    assert np.max(np.abs(fit.pixels[0] - view.truth)) < 0.03


def test_many_squares_are_fitted_as_one():
    spec = targets.parse("apriltag-grid:36h11:2x2:20mm:6mm")
    corners = targets.build(spec).points()[:, :2].reshape(-1, 4, 2)
    rng = np.random.default_rng(37)
    view = View.at(rng, 25.0, 100)
    picture = expose(paint_target(CAMERA, view.pose, targets.build(spec).drawing()), 0.0, None)
    light = np.zeros((4, 4, CELLS - 2), dtype=bool)
    every = Squares(corners, CELLS, light, margin=1.0)
    start = view.to_pixel(corners)
    together = fit_squares(picture, every, view.to_pixel, start)
    for k in range(4):
        alone = replace(every, corners=corners[k : k + 1], light=light[k : k + 1])
        fit = fit_squares(picture, alone, view.to_pixel, start[k : k + 1])
        np.testing.assert_allclose(fit.pixels[0], together.pixels[k], atol=0.01)


@pytest.mark.parametrize(
    "look",
    [
        {"paper": 240.0, "gradient": (0.6, 0.2)},
        {"paper": 310.0, "ink": 50.0},
        {"ink": -15.0},
        {"paper": 290.0, "ink": -20.0},
    ],
)
def test_light_beyond_the_limits_of_the_sensor_does_no_harm(look):
    """White on one side, white all over, black ink, both: chi-square of 2 per corner of 24.

    Corners of one tag share sides: an effective 18 of the 24. Clipped light that is taken for seen
    moves corners by a tenth of a pixel and more.
    """
    rng = np.random.default_rng(37)
    squares_, worst = [], []
    for tilt_deg in (10.0, 30.0, 50.0):
        view = View.at(rng, tilt_deg, 120)
        light = view.light(**look)
        for _ in range(2):
            picture = expose(light, 2.0, rng)
            assert np.mean((picture == 0) | (picture == 255)) > 0.005
            fit = view.fit(rng, picture)
            error = (fit.pixels - view.truth).reshape(-1, 2)
            weight = np.linalg.inv(fit.covariance.reshape(-1, 2, 2))
            squares_.append(np.einsum("ni,nij,nj->n", error, weight, error))
            worst.append(np.max(np.abs(error)))
    assert np.mean(squares_) < 2.0 + 4 * 2 / np.sqrt(18)
    assert np.max(worst) < 0.05
