"""The fit of discs against pictures drawn with known truth."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
import pytest

from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import project
from handeye_cli.geometry.disc_conics import PlateInView
from handeye_cli.geometry.disc_fit import DiscFit, fit_discs
from handeye_cli.records import Camera
from handeye_cli.simulate.bound import centre_bound
from handeye_cli.simulate.random_views import DiscView
from handeye_cli.simulate.render import Appearance, expose, paint_target, render_target
from handeye_cli.simulate.scenery import Scenery, shade
from handeye_cli.targets.drawing import Drawing

CAMERA = Camera(480, 400, 620.0, 615.0, 240.0, 200.0, (-0.2, 0.05, 1e-3, -1e-3, 0.0))
COLUMN, ROW = np.meshgrid(np.arange(5), np.arange(5))
CENTRES = 5e-3 * np.stack([COLUMN.ravel(), ROW.ravel()], axis=1)
DISCS = np.concatenate([CENTRES, np.full((25, 1), 2e-3)], axis=1)
LIGHT = Appearance(gradient=(0.2, 0.1))


@dataclass(frozen=True)
class View:
    """A pose of the plate with the truth of its picture."""

    pose: np.ndarray

    @classmethod
    def at(cls, rng, tilt_deg, distance=0.065):
        across = rng.uniform(0, 2 * np.pi)
        tilt = np.radians(tilt_deg) * np.array([np.cos(across), np.sin(across), 0.0])
        R = rotations.exp(tilt) @ rotations.exp(np.array([0, 0, rng.uniform(-3, 3)]))
        middle = R @ np.append(CENTRES.mean(axis=0), 0.0)
        aside = distance * rng.uniform(-0.03, 0.03, 2)
        return cls(se3.from_parts(R, np.append(aside, distance) - middle))

    def to_pixel(self, plate):
        points = np.concatenate([plate, np.zeros((*plate.shape[:-1], 1))], axis=-1)
        here = points @ self.pose[:3, :3].T + self.pose[:3, 3]
        return project(here, CAMERA.parameters)

    @property
    def truth(self):
        return self.to_pixel(CENTRES)

    def picture(self, rng=None, radius=2e-3, **look):
        look = Appearance(**{"gradient": (0.2, 0.1), **look})
        plate = Drawing(np.column_stack([CENTRES, np.full(25, radius)]))
        return render_target(CAMERA, self.pose, plate, appearance=look, rng=rng)

    def bound(self, scenery=None, **look):
        """The least RMS error of the centres, from what moving the discs does to the picture."""
        look, nothing = Appearance(**{"gradient": (0.2, 0.1), **look}), np.zeros((25, 2))
        size = np.zeros((CAMERA.height, CAMERA.width), dtype=np.uint8)
        view = DiscView(
            size, self.pose, 0.0, nothing, nothing, 0.0, Drawing(DISCS), scenery or Scenery(), look
        )
        return np.sqrt(np.mean(np.trace(centre_bound(CAMERA, view), axis1=1, axis2=2)) / 2)

    def fit(self, rng, picture) -> DiscFit:
        start = self.truth + rng.normal(scale=0.2, size=self.truth.shape)
        return fit_discs(picture, PlateInView(DISCS, self.to_pixel), start)


def rms(fit, view):
    return float(np.sqrt(np.mean((fit.pixels - view.truth) ** 2)))


@pytest.mark.parametrize("tilt_deg", [0.0, 20.0, 40.0, 55.0])
def test_centres_have_the_errors_that_the_noise_leaves(tilt_deg):
    """Chi-square of 2 per disc over 75 discs, and the noise of the pixels, both two-sided."""
    rng = np.random.default_rng(int(tilt_deg))
    squares, noise = [], []
    for _ in range(3):
        view = View.at(rng, tilt_deg)
        fit = view.fit(rng, view.picture(rng, noise=3.0))
        error = fit.pixels - view.truth
        squares.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(fit.covariance), error))
        noise.append(fit.noise)
    assert np.mean(squares) == pytest.approx(2.0, abs=4 * 2 / np.sqrt(75))
    # rounding to whole grey levels adds 1 / 12
    assert np.mean(noise) == pytest.approx(np.sqrt(9 + 1 / 12), rel=0.03)


@pytest.mark.parametrize("tilt_deg", [0.0, 20.0, 40.0, 55.0])
def test_without_noise_the_centre_is_the_discs_and_not_the_ellipses(tilt_deg):
    rng = np.random.default_rng(50 + int(tilt_deg))
    view = View.at(rng, tilt_deg)
    fit = view.fit(rng, view.picture())
    assert rms(fit, view) < 0.0015
    assert np.max(np.abs(fit.growth)) < 0.005
    assert fit.blur == pytest.approx(np.sqrt(0.7**2 + 1 / 12), rel=0.03)


@pytest.mark.parametrize("distance", [0.05, 0.09, 0.16, 0.24])
def test_discs_from_ten_to_fifty_pixels(distance):
    """At the far end the gaps are two pixels wide, and the neighbours' edges reach across."""
    rng = np.random.default_rng(7)
    view = View.at(rng, 30.0, distance)
    fit = view.fit(rng, view.picture())
    assert rms(fit, view) < 0.003
    noisy = view.fit(rng, view.picture(rng, noise=2.0))
    sigma = np.sqrt(np.mean(np.trace(noisy.covariance, axis1=1, axis2=2)) / 2)
    assert rms(noisy, view) == pytest.approx(sigma, rel=0.45)


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
    fit = view.fit(rng, view.picture(**look))
    assert rms(fit, view) < 0.004
    expected = look.get("paper", 205.0) - look.get("ink", 35.0)
    assert np.median(fit.contrast) == pytest.approx(expected, rel=0.1)


def test_discs_printed_five_percent_too_large():
    rng = np.random.default_rng(13)
    view = View.at(rng, 35.0)
    fit = view.fit(rng, view.picture(radius=2.1e-3))
    assert rms(fit, view) < 0.01
    assert np.median(fit.growth) == pytest.approx(0.05, abs=0.003)


def test_compressed_pictures_lose_little():
    rng = np.random.default_rng(17)
    view = View.at(rng, 30.0)
    _, data = cv2.imencode(".jpg", view.picture(rng, noise=1.0), [cv2.IMWRITE_JPEG_QUALITY, 80])
    picture = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)
    assert rms(view.fit(rng, picture), view) < 0.01


def test_a_covered_disc_stands_out_and_leaves_the_others_alone():
    rng = np.random.default_rng(19)
    view = View.at(rng, 10.0)
    picture = view.picture(rng, noise=2.0)
    u, v = np.rint(view.truth[12]).astype(int)
    picture[v - 20 : v + 1, u - 20 : u + 21] = 120
    fit = view.fit(rng, picture)
    assert fit.misfit[12] > 50.0
    others = np.delete(np.arange(25), 12)
    assert np.sqrt(np.mean((fit.pixels - view.truth)[others] ** 2)) < 0.01


def test_a_disc_at_the_images_edge_uses_what_is_there():
    rng = np.random.default_rng(23)
    view = View(se3.from_parts(np.eye(3), np.array([-0.0278, -0.01, 0.065])))
    picture = view.picture(rng, noise=2.0)
    fit = view.fit(rng, picture)
    assert np.all(np.isfinite(fit.pixels))
    cut = view.truth[:, 0] < 20
    assert cut.any()
    spread = np.sqrt(np.trace(fit.covariance, axis1=1, axis2=2))
    assert spread[cut].min() > spread[~cut].max()


def test_the_first_guess_may_be_a_pixel_off():
    rng = np.random.default_rng(29)
    view = View.at(rng, 25.0)
    picture = view.picture(rng, noise=2.0)
    near = view.fit(rng, picture)
    start = view.truth + np.array([0.8, -0.8])
    away = fit_discs(picture, PlateInView(DISCS, view.to_pixel), start)
    assert np.max(np.abs(away.pixels - near.pixels)) < 0.003


CLIPPED = [
    {"paper": 240.0, "gradient": (0.5, 0.2)},
    {"paper": 320.0, "ink": 60.0},
    {"ink": -15.0},
    {"paper": 290.0, "ink": -20.0, "gradient": (-0.1, 0.3)},
    {"paper": 40.0, "ink": 290.0},
]
"""White on one side, white all over, black discs, both, white discs."""


@pytest.mark.parametrize(
    ("look", "tilt_deg"), [(look, (10.0, 45.0)[k % 2]) for k, look in enumerate(CLIPPED)]
)
def test_light_beyond_the_limits_of_the_sensor_does_no_harm(look, tilt_deg):
    """The bound knows that clipped pixels tell nothing, but takes the light for known. That costs a
    tenth where paper is seen, and much where all of it is white. An RMS of 200 numbers is known
    within a twentieth.
    """
    rng = np.random.default_rng([31, int(tilt_deg)])
    view = View.at(rng, tilt_deg)
    plate, appearance = Drawing(DISCS), Appearance(**{"gradient": (0.2, 0.1), **look})
    light = paint_target(CAMERA, view.pose, plate, appearance=appearance)
    errors, squares = [], []
    for _ in range(4):
        picture = expose(light, 2.0, rng)
        assert np.mean((picture == 0) | (picture == 255)) > 0.08
        fit = view.fit(rng, picture)
        error = fit.pixels - view.truth
        errors.append(error)
        squares.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(fit.covariance), error))
    ratio = np.sqrt(np.mean(np.square(errors))) / view.bound(noise=2.0, **look)
    price = 1.8 if look.get("paper", 0.0) > 300.0 else 1.1
    assert 1.0 - 4 / 20 < ratio < price + 4 / 20
    # sigma is honest within a fifth
    assert 1.2**-2 < np.mean(squares) / 2.0 < 0.8**-2


@pytest.mark.parametrize("look", CLIPPED)
def test_without_noise_light_beyond_the_limits_leaves_no_bias(look):
    rng = np.random.default_rng(37)
    view = View.at(rng, 35.0)
    assert rms(view.fit(rng, view.picture(**look)), view) < 0.003


@pytest.mark.parametrize("distance", [0.065, 0.16])
def test_drawings_in_sharp_black_and_white_lose_no_disc(distance):
    """Hardly a pixel is grey there, and nothing tells how bright white is."""
    rng = np.random.default_rng(41)
    for tilt_deg in (0.0, 30.0, 50.0):
        view = View.at(rng, tilt_deg, distance)
        picture = view.picture(ink=0.0, paper=255.0, blur_px=0.05, gradient=(0.0, 0.0))
        fit = view.fit(rng, picture)
        assert np.max(np.abs(fit.pixels - view.truth)) < 0.05
        assert np.max(fit.misfit) < 10.0


TINY = Appearance(blur_px=1.0, gradient=(0.3, 0.2))


@pytest.mark.parametrize(("tilt_deg", "distance"), [(30.0, 0.30), (50.0, 0.26), (55.0, 0.34)])
def test_discs_hardly_larger_than_their_blur_reach_the_bound(tilt_deg, distance):
    """Half axes of 2.1 to 4.1 pixels and a blur of 1.04: neighbours' edges lie in each other.

    An RMS of 150 numbers is known within 6 %, but errors of neighbours go together.
    """
    rng = np.random.default_rng([43, int(tilt_deg)])
    view = View.at(rng, tilt_deg, distance)
    light = paint_target(CAMERA, view.pose, Drawing(DISCS), appearance=TINY)
    errors, squares = [], []
    for _ in range(3):
        fit = view.fit(rng, expose(light, 1.5, rng))
        error = fit.pixels - view.truth
        errors.append(error)
        squares.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(fit.covariance), error))
    bound = view.bound(blur_px=1.0, gradient=(0.3, 0.2), noise=1.5)
    assert 0.8 < np.sqrt(np.mean(np.square(errors))) / bound < 1.3
    assert 1.3**-2 < np.mean(squares) / 2.0 < 1.3**2


def test_small_discs_have_no_bias():
    rng = np.random.default_rng(47)
    view = View.at(rng, 50.0, 0.26)
    light = paint_target(CAMERA, view.pose, Drawing(DISCS), appearance=TINY)
    errors = np.array(
        [view.fit(rng, expose(light, 0.5, rng)).pixels - view.truth for _ in range(8)]
    )
    chance = np.mean(errors.var(axis=0, ddof=1)) / 8
    assert np.mean(errors.mean(axis=0) ** 2) < 0.001**2 + chance


@pytest.mark.parametrize("margin", [1.7e-3, 2.5e-3])
def test_the_end_of_the_plate_close_to_small_discs_does_no_harm(margin):
    """It is 2 blurs and more from the outer discs, where the light falls by half."""
    rng = np.random.default_rng([53, int(1e4 * margin)])
    view = View.at(rng, 50.0, 0.26)
    low, high = CENTRES.min(axis=0) - 2e-3 - margin, CENTRES.max(axis=0) + 2e-3 + margin
    plate = Drawing(DISCS, outline=np.stack([low, high]))
    look = replace(TINY, background=100.0)
    light = paint_target(CAMERA, view.pose, plate, appearance=look)
    errors = [view.fit(rng, expose(light, 1.5, rng)).pixels - view.truth for _ in range(3)]
    bound = view.bound(blur_px=1.0, gradient=(0.3, 0.2), noise=1.5)
    assert np.sqrt(np.mean(np.square(errors))) / bound < 1.5


@pytest.mark.parametrize(("tilt_deg", "background"), [(55.0, 90.0), (55.0, 30.0), (50.0, 30.0)])
def test_the_end_of_the_plate_is_told_from_small_discs_not_yet_fitted(tilt_deg, background):
    """It leads the row next to it astray; with little noise good pixels of that row look strange
    then, more than those that see the end.
    """
    rng = np.random.default_rng([77, 0])
    view = View.at(rng, tilt_deg, 0.26)
    plate = Drawing(DISCS, outline=np.stack([DISCS[0, :2] - 3.8e-3, DISCS[-1, :2] + 3.8e-3]))
    light = paint_target(CAMERA, view.pose, plate, appearance=replace(TINY, background=background))
    fit = view.fit(rng, expose(light, 0.5, rng))
    assert rms(fit, view) / view.bound(blur_px=1.0, gradient=(0.3, 0.2), noise=0.5) < 1.5
    assert np.max(fit.misfit) < 2.0


@pytest.mark.parametrize("radius", [1.9e-3, 2.1e-3])
def test_small_discs_printed_five_percent_too_small_or_large(radius):
    rng = np.random.default_rng(59)
    view = View.at(rng, 50.0, 0.26)
    plate = Drawing(np.column_stack([CENTRES, np.full(25, radius)]))
    light = paint_target(CAMERA, view.pose, plate, appearance=TINY)
    fit = view.fit(rng, expose(light, 0.5, rng))
    assert rms(fit, view) < 0.01
    assert np.median(fit.growth) == pytest.approx(radius / 2e-3 - 1.0, abs=0.01)


@pytest.mark.parametrize(("distance", "shadow_px"), [(0.065, 14.0), (0.1, 10.0), (0.16, 4.0)])
def test_discs_that_the_edge_of_a_shadow_crosses_reach_the_bound(distance, shadow_px):
    """The edge is sharper than a disc, whose light is then no plane and no quadratic."""
    rng = np.random.default_rng([61, int(shadow_px)])
    view = View.at(rng, 25.0, distance)
    scenery = Scenery(shadow=0.5, shadow_px=shadow_px, shadow_angle=0.6)
    light = paint_target(CAMERA, view.pose, Drawing(DISCS), appearance=LIGHT)
    light *= shade(CAMERA, scenery, view.truth.mean(axis=0))
    errors, squares = [], []
    for _ in range(3):
        fit = view.fit(rng, expose(light, 2.0, rng))
        error = fit.pixels - view.truth
        errors.append(error)
        squares.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(fit.covariance), error))
    ratio = np.sqrt(np.mean(np.square(errors))) / view.bound(scenery=scenery, noise=2.0)
    assert 0.8 < ratio < 1.4
    assert 1.3**-2 < np.mean(squares) / 2.0 < 1.3**2
    # light as it is seen, from ink to paper
    lit = (view.truth - view.truth.mean(axis=0)) @ [np.cos(0.6), np.sin(0.6)] < -3 * shadow_px
    assert np.median(fit.contrast[lit]) == pytest.approx(170.0, rel=0.15)


@pytest.mark.parametrize(
    ("distance", "shadow_px", "shadow"),
    [(0.065, 0.5, 0.3), (0.065, 2.0, 0.55), (0.1, 1.0, 0.5), (0.13, 1.5, 0.4)],
)
def test_very_sharp_shadows_over_few_discs_reach_the_bound(distance, shadow_px, shadow):
    """What they cross has the largest residuals of all, and alone tells where the edge is."""
    rng = np.random.default_rng([71, int(1e3 * distance)])
    scenery = Scenery(shadow=shadow, shadow_px=shadow_px, shadow_angle=rng.uniform(0, 6))
    errors, bounds, squares = [], [], []
    for _ in range(3):
        view = View.at(rng, 25.0, distance)
        light = paint_target(CAMERA, view.pose, Drawing(DISCS), appearance=LIGHT)
        light *= shade(CAMERA, scenery, view.truth.mean(axis=0))
        fit = view.fit(rng, expose(light, 2.0, rng))
        error = fit.pixels - view.truth
        errors.append(error)
        bounds.append(view.bound(scenery=scenery, noise=2.0))
        squares.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(fit.covariance), error))
    ratios = np.sqrt(np.mean(np.square(errors), axis=(1, 2))) / bounds
    assert np.max(ratios) < 1.5
    assert 1.2**-2 < np.mean(squares) / 2.0 < 0.8**-2


def test_a_sharp_shadow_beside_some_clipped_light_reaches_the_bound():
    """Some paper is white, which does not hide what the shadow does elsewhere."""
    rng = np.random.default_rng(67)
    view = View.at(rng, 20.0, 0.065)
    scenery = Scenery(shadow=0.5, shadow_px=14.0, shadow_angle=0.6)
    light = paint_target(CAMERA, view.pose, Drawing(DISCS), appearance=replace(LIGHT, paper=256.0))
    light *= shade(CAMERA, scenery, view.truth.mean(axis=0))
    bound = view.bound(scenery=scenery, paper=256.0, noise=2.0)
    errors = []
    for _ in range(3):
        picture = expose(light, 2.0, rng)
        assert 0.0005 < np.mean(picture == 255) < 0.1
        errors.append(view.fit(rng, picture).pixels - view.truth)
    assert np.sqrt(np.mean(np.square(errors))) / bound < 1.5


@pytest.mark.parametrize(("paper", "shadow_px"), [(290.0, 1.0), (320.0, 5.0)])
def test_a_very_sharp_shadow_on_white_paper_costs_little(paper, shadow_px):
    """Paper is white but for the shadow. The bound takes the light for known, which costs up to
    1.8 where paper is white and there is no shadow.
    """
    rng = np.random.default_rng([73, int(paper)])
    scenery = Scenery(shadow=0.4, shadow_px=shadow_px, shadow_angle=0.6)
    look = Appearance(gradient=(0.2, 0.1), paper=paper)
    errors, bounds, squares = [], [], []
    for _ in range(3):
        view = View.at(rng, 20.0, 0.065)
        light = paint_target(CAMERA, view.pose, Drawing(DISCS), appearance=look)
        light *= shade(CAMERA, scenery, view.truth.mean(axis=0))
        fit = view.fit(rng, expose(light, 2.0, rng))
        error = fit.pixels - view.truth
        errors.append(error)
        bounds.append(view.bound(scenery=scenery, paper=paper, noise=2.0))
        squares.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(fit.covariance), error))
    assert np.max(np.sqrt(np.mean(np.square(errors), axis=(1, 2))) / bounds) < 2.0
    assert 1.25**-2 < np.mean(squares) / 2.0 < 0.8**-2
