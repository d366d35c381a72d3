"""The Cramer-Rao bound of a disc's centre against the formula for one seen straight on."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from handeye_cli.geometry import se3
from handeye_cli.records import Camera
from handeye_cli.simulate.bound import centre_bound, told_of_light
from handeye_cli.simulate.random_views import DiscView
from handeye_cli.simulate.render import Appearance
from handeye_cli.simulate.scenery import Scenery
from handeye_cli.targets.drawing import Drawing

CAMERA = Camera(320, 240, 400.0, 400.0, 160.0, 120.0)
DISCS = np.array([[0.0, 0.0, 2e-3], [8e-3, 0.0, 2e-3], [0.0, 6e-3, 3e-3]])


def view(appearance, scenery=None, distance=0.05):
    pose = se3.from_parts(np.eye(3), np.array([-0.003, -0.002, distance]))
    nothing = np.zeros((len(DISCS), 2))
    return DiscView(
        np.zeros((240, 320), dtype=np.uint8), pose, 0.0, nothing, nothing, 0.0, Drawing(DISCS),
        scenery or Scenery(), appearance,
    )  # fmt: skip


@pytest.mark.parametrize("blur", [0.5, 0.8, 1.2])
@pytest.mark.parametrize("noise", [1.0, 4.0])
def test_discs_seen_straight_on(blur, noise):
    """sigma_x = noise / contrast sqrt(2 b / (sqrt(pi) R)), with the pixels' own blur in b."""
    look = Appearance(ink=30.0, paper=200.0, blur_px=blur, noise=noise)
    found = centre_bound(CAMERA, view(look))
    radius = 400.0 * DISCS[:, 2] / 0.05
    wide = np.sqrt(blur**2 + 1 / 12)
    sigma = np.sqrt(noise**2 + 1 / 12) / 170.0 * np.sqrt(2 * wide / (np.sqrt(np.pi) * radius))
    np.testing.assert_allclose(
        np.sqrt(found[:, [0, 1], [0, 1]]), np.stack([sigma] * 2, 1), rtol=0.02
    )
    assert np.abs(found[:, 0, 1]).max() < 0.02 * found[:, 0, 0].min()


def test_half_the_light_doubles_it():
    look = Appearance(noise=2.0)
    full = centre_bound(CAMERA, view(look))
    dark = centre_bound(CAMERA, view(look, Scenery(shadow=0.5, shadow_px=1.0, shadow_angle=0.0)))
    # the shadow falls on the middle disc, whose right neighbour lies all in it
    assert dark[1, 0, 0] == pytest.approx(4.0 * full[1, 0, 0], rel=0.02)


def test_clipped_white_tells_nothing():
    """The outer half of every edge is lost, and more than half of what it told."""
    plain = centre_bound(CAMERA, view(Appearance(paper=250.0)))
    clipped = centre_bound(CAMERA, view(Appearance(paper=400.0, ink=100.0)))
    assert np.all(clipped[:, 0, 0] > plain[:, 0, 0] * (220.0 / 300.0) ** 2)


def test_black_tells_nothing_either():
    plain = centre_bound(CAMERA, view(Appearance(ink=5.0)))
    clipped = centre_bound(CAMERA, view(Appearance(ink=-145.0, paper=205.0)))
    assert np.all(clipped[:, 0, 0] > plain[:, 0, 0] * (200.0 / 350.0) ** 2)


@pytest.mark.parametrize("light", [-2.0, 1.0, 120.0, 251.0, 254.5, 257.0])
def test_what_clipped_pixels_tell_is_the_variance_of_their_score(light):
    """Of 400 000 pixels: the variance is known within 0.5 %, four times that is allowed."""
    noise, step = 2.0, 1e-3
    rng = np.random.default_rng(5)
    seen = np.clip(light + rng.normal(0.0, noise, 400_000), 0.5, 254.5)

    def log_likelihood(mean):
        within = norm.logpdf(seen, mean, noise)
        black, white = norm.logcdf(0.5, mean, noise), norm.logsf(254.5, mean, noise)
        return np.where(seen == 0.5, black, np.where(seen == 254.5, white, within))

    score = (log_likelihood(light + step) - log_likelihood(light - step)) / (2 * step)
    expected = np.var(score) * noise**2
    assert told_of_light(np.array(light), noise) == pytest.approx(expected, rel=0.02)
    assert told_of_light(np.array([-1e4, 1e4]), noise) == pytest.approx(0.0)
