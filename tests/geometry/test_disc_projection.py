"""Centres from outlines, and distances from edges, against the full camera model."""

from __future__ import annotations

import numpy as np
import pytest

from handeye_cli.geometry import rotations
from handeye_cli.geometry.blurred_edge import normal_distribution
from handeye_cli.geometry.camera import project
from handeye_cli.geometry.disc_edges import measure
from handeye_cli.geometry.disc_pixels import edge_pixels, look_at
from handeye_cli.geometry.disc_projection import centres_of, outlines

LENS = np.array([600.0, 605.0, 320.0, 240.0, -0.25, 0.08, 1e-3, -1e-3, 0.01])
DISCS = np.array([[0.0, 0.0, 2e-3], [7e-3, 1e-3, 3e-3], [1e-3, 8e-3, 2e-3], [9e-3, 9e-3, 2.5e-3]])


def through(tilt_deg, distance=0.06, at=(0.008, -0.006)):
    R = rotations.exp(np.radians(tilt_deg) * np.array([0.8, 0.6, 0.0]))
    offset = np.array([*at, distance])

    def to_pixel(plate):
        points = np.concatenate([plate, np.zeros((*plate.shape[:-1], 1))], axis=-1)
        return project(points @ R.T + offset, LENS)

    return to_pixel


def flat(to_pixel):
    """The map without its perspective and distortion, as a homography of a plane has neither."""
    centre = to_pixel(np.zeros(2))
    J = (to_pixel(1e-6 * np.eye(2)) - to_pixel(-1e-6 * np.eye(2))).T / 2e-6
    return lambda plate: plate @ J.T + centre


@pytest.mark.parametrize("tilt_deg", [0.0, 30.0, 55.0])
def test_the_centre_of_the_mapped_outline_is_the_mapped_centre(tilt_deg):
    to_pixel = through(tilt_deg)
    shift = np.array([3.0, -2.0])
    found = centres_of(outlines(DISCS, to_pixel) + shift, DISCS, to_pixel)
    np.testing.assert_allclose(found, to_pixel(DISCS[:, :2]) + shift, atol=1e-9)


@pytest.mark.parametrize("tilt_deg", [0.0, 30.0, 55.0])
def test_an_ellipse_that_was_fitted_to_an_outline_gives_the_same_centre(tilt_deg):
    """The ellipse knows nothing of the camera; through the camera it has the right centre."""
    to_pixel, disc = through(tilt_deg), DISCS[:1]
    plain, truth = flat(to_pixel), to_pixel(DISCS[:1, :2])
    middle = centres_of(outlines(disc, to_pixel), disc, plain)
    off = np.abs(middle - truth).max()
    assert off > 0.02
    ellipse = outlines(disc, plain) - plain(disc[:, :2])[:, None] + middle[:, None]
    assert np.abs(centres_of(ellipse, disc, to_pixel) - truth).max() < 0.01 * off


def nearest_on_outline(pixel, disc, to_pixel):
    """The distance of a pixel from the outline, by brute force."""
    angle = np.linspace(0, 2 * np.pi, 40001)
    ring = disc[:2] + disc[2] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return np.sqrt(np.min(np.sum((to_pixel(ring) - pixel) ** 2, axis=1)))


@pytest.mark.parametrize("tilt_deg", [0.0, 30.0, 55.0])
def test_distances_are_those_to_the_outline(tilt_deg):
    """To second order: what is left grows with the third power of the distance over the radius."""
    to_pixel = through(tilt_deg)
    image = np.zeros((480, 640), dtype=np.uint8)
    start = to_pixel(DISCS[:, :2])
    patches = look_at(DISCS, to_pixel, start, 4.0)
    pixels = edge_pixels(image, patches, outlines(DISCS, to_pixel), 2.0)
    still = np.zeros((len(DISCS), 3))
    sharp = measure(patches, pixels, still, blur=0.0, band=2.0)
    blurred = measure(patches, pixels, still, blur=0.8, band=2.0)
    rng = np.random.default_rng(1)
    for k, disc in enumerate(DISCS):
        for m in rng.choice(np.flatnonzero(sharp.weight[k]), 12, replace=False):
            at = patches.middle[k] + patches.half * pixels.terms[k, 1:3, m]
            expected = nearest_on_outline(at, disc, to_pixel)
            assert abs(sharp.distance[k, m]) == pytest.approx(expected, abs=0.01)
    # half of the variance times the curvature, that of a circle where nothing is tilted
    inside = (sharp.distance - blurred.distance)[0][sharp.weight[0] > 0]
    assert np.all(inside > 0)
    if tilt_deg == 0.0:
        across = np.ptp(outlines(DISCS, to_pixel)[0], axis=0)
        assert np.median(inside) == pytest.approx(0.5 * 0.8**2 / (across.mean() / 2), rel=0.03)


def test_every_pixel_in_the_band_is_selected():
    to_pixel = through(40.0)
    image = np.zeros((480, 640), dtype=np.uint8)
    patches = look_at(DISCS, to_pixel, to_pixel(DISCS[:, :2]), 4.0)
    pixels = edge_pixels(image, patches, outlines(DISCS, to_pixel), 2.0)
    found = measure(patches, pixels, np.zeros((4, 3)), blur=0.0, band=2.0)
    u, v = np.meshgrid(np.arange(-60, 61), np.arange(-60, 61))
    for k, disc in enumerate(DISCS):
        around = patches.middle[k] + np.stack([u.ravel(), v.ravel()], axis=1)
        angle = np.linspace(0, 2 * np.pi, 721)
        ring = to_pixel(disc[:2] + disc[2] * np.stack([np.cos(angle), np.sin(angle)], axis=-1))
        apart = np.sqrt(np.min(np.sum((around[:, None] - ring) ** 2, axis=-1), axis=1))
        assert found.weight[k].sum() == pytest.approx(np.sum(apart < 2.0), abs=4)


def test_coverage_is_the_normal_distribution():
    x = np.linspace(-6, 6, 1001).astype(np.float32)
    share, density = normal_distribution(x)
    step = 1e-3
    exact = np.cumsum(np.exp(-0.5 * np.arange(-9, 6, step) ** 2)) * step / np.sqrt(2 * np.pi)
    np.testing.assert_allclose(
        share, np.interp(x, np.arange(-9, 6, step) + step / 2, exact), atol=1e-6
    )
    np.testing.assert_allclose(density, np.exp(-0.5 * x * x) / np.sqrt(2 * np.pi), atol=1e-6)
