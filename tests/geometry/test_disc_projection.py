"""Centres from outlines, against the full camera model."""

from __future__ import annotations

import numpy as np
import pytest

from handeye_cli.geometry import rotations
from handeye_cli.geometry.camera import project
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
