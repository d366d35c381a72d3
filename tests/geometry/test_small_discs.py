"""The share of pixels that small discs cover, against a sum over many points of the discs."""

from __future__ import annotations

import numpy as np
import pytest

from handeye_cli.geometry import rotations
from handeye_cli.geometry.camera import project
from handeye_cli.geometry.disc_conics import conics_of, images_of
from handeye_cli.geometry.disc_pixels import area_pixels
from handeye_cli.geometry.small_discs import SmallDiscs

LENS = np.array([620.0, 615.0, 160.0, 120.0, -0.2, 0.05, 1e-3, -1e-3, 0.0])
IMAGE = np.full((240, 320), 100, dtype=np.uint8)
DISCS = 1e-3 * np.array([[0.0, 0.0, 2.0], [5.0, 0.0, 2.0], [0.0, 5.0, 2.5], [5.0, 5.0, 1.5]])
BLUR = 1.1
RINGS, SPOKES = 60, 240


def through(tilt_deg, distance=0.24):
    R = rotations.exp(np.radians(tilt_deg) * np.array([0.8, 0.6, 0.0]))

    def to_pixel(plate):
        points = np.concatenate([plate, np.zeros((*plate.shape[:-1], 1))], axis=-1)
        return project(points @ R.T + np.array([0.002, -0.004, distance]), LENS)

    return to_pixel


def seen(to_pixel):
    images = images_of(DISCS, to_pixel)
    conics = conics_of(images)
    return conics, SmallDiscs.of(images, conics, area_pixels(IMAGE, conics, 3.2 * BLUR), BLUR)


def covered(discs, shape):
    slopes = np.zeros((4, *discs.grey.shape), dtype=np.float32)
    single = shape.astype(np.float32)
    return discs.covered(single, np.ones_like(discs.grey), slopes).astype(float), slopes


def at_rest():
    return np.tile([0.0, 0.0, 0.0, BLUR], (len(DISCS), 1))


def summed(disc, to_pixel, pixels, blur):
    """The blurred disc at (m, 2) pixels: points of equal area on the plate, and their images'."""
    share = (np.arange(RINGS) + 0.5) / RINGS
    angle = 2 * np.pi * np.arange(SPOKES) / SPOKES
    unit = np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    def place(radius):
        return to_pixel(disc[:2] + disc[2] * radius[:, None, None] * unit)

    points = place(np.sqrt(share)).reshape(-1, 2)
    # the area of each image is the determinant of the map's derivatives
    step = 1e-3 * disc[2]
    plate = (disc[:2] + disc[2] * np.sqrt(share)[:, None, None] * unit).reshape(-1, 2)
    columns = [(to_pixel(plate + d) - to_pixel(plate - d)) / (2 * step) for d in step * np.eye(2)]
    area = np.linalg.det(np.stack(columns, axis=-1)) * np.pi * disc[2] ** 2 / (RINGS * SPOKES)
    apart = np.sum((pixels[:, None] - points) ** 2, axis=-1)
    return np.exp(-0.5 * apart / blur**2) @ area / (2 * np.pi * blur**2)


@pytest.mark.parametrize("tilt_deg", [0.0, 35.0, 60.0])
def test_shares_are_those_of_all_discs_together(tilt_deg):
    """Half axes of 2.0 to 6 pixels and a blur of 1.1."""
    to_pixel = through(tilt_deg)
    conics, discs = seen(to_pixel)
    shares, _ = covered(discs, at_rest())
    rng = np.random.default_rng(3)
    for k in range(len(DISCS)):
        chosen = rng.choice(np.flatnonzero(discs.held[k]), 25, replace=False)
        pixels = conics.origin[k] + discs.terms[1:3, k, chosen].T
        expected = sum(summed(disc, to_pixel, pixels, BLUR) for disc in DISCS)
        # what a disc adds beyond 3.2 blurs is left out: up to 7e-4 by each neighbour
        np.testing.assert_allclose(shares[k, chosen], expected, atol=2e-3)


@pytest.mark.parametrize("tilt_deg", [0.0, 60.0])
def test_derivatives_by_a_discs_own_shape(tilt_deg):
    _, discs = seen(through(tilt_deg))
    rng = np.random.default_rng(5)
    shape = at_rest() + rng.uniform(-0.03, 0.03, (len(DISCS), 4))
    _, slopes = covered(discs, shape)
    for k in range(len(DISCS)):
        inside = discs.held[k] > 0
        for p, step in enumerate([0.02, 0.02, 0.02, 0.05]):
            ends = []
            for sign in (1.0, -1.0):
                moved = shape.copy()
                moved[k, p] += sign * step
                ends.append(covered(discs, moved)[0][k])
            expected = (ends[0] - ends[1]) / (2 * step)
            largest = np.max(np.abs(expected))
            np.testing.assert_allclose(slopes[p, k, inside], expected[inside], atol=0.02 * largest)


def test_strange_pixels_and_those_next_to_them_are_left_out_of_every_disc():
    conics, discs = seen(through(20.0))
    strange = np.zeros(discs.grey.shape, dtype=bool)
    chosen = int(np.flatnonzero(discs.held[1])[40])
    strange[1, chosen] = True
    left = discs.without(strange)
    place = conics.origin[1] + discs.terms[1:3, 1, chosen]
    for k in range(len(DISCS)):
        at = conics.origin[k] + discs.terms[1:3, k].T
        near = np.max(np.abs(at - place), axis=1) < 1.5
        np.testing.assert_array_equal(left.weight[k], discs.weight[k] * ~near)
    np.testing.assert_array_equal(left.grey, discs.grey * left.weight)
    # what a disc covers does not depend on which pixels are believed
    np.testing.assert_array_equal(covered(left, at_rest())[0], covered(discs, at_rest())[0])


def test_a_disc_that_is_strange_itself_keeps_its_pixels():
    _, discs = seen(through(20.0))
    strange = np.zeros(discs.grey.shape, dtype=bool)
    strange[2] = True
    np.testing.assert_array_equal(discs.without(strange).weight[2], discs.weight[2])


def test_linearised_shares_follow_small_changes():
    _, discs = seen(through(35.0))
    near = discs.linear(at_rest().astype(np.float32))
    moved = at_rest()
    moved[1] += [0.01, -0.008, 0.005, 0.01]
    change = covered(discs, moved)[0][1] - near.share[1]
    followed = covered(near, moved)[0][1] - near.share[1]
    inside = near.weight[1] > 0
    assert np.max(np.abs(change[inside])) > 0.01
    np.testing.assert_allclose(followed[inside], change[inside], atol=0.001)
