"""Conics of outlines, and distances from edges, against the full camera model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import KDTree

from handeye_cli.geometry import rotations
from handeye_cli.geometry.camera import project
from handeye_cli.geometry.disc_conics import conics_of, images_of, moved_to, offsets_of_middles
from handeye_cli.geometry.disc_edges import measure, others_of
from handeye_cli.geometry.disc_pixels import band_pixels, spoke_pixels

LENS = np.array([600.0, 605.0, 320.0, 240.0, -0.25, 0.08, 1e-3, -1e-3, 0.01])
DISCS = np.array([[0.0, 0.0, 2e-3], [7e-3, 1e-3, 3e-3], [1e-3, 8e-3, 2e-3], [9e-3, 9e-3, 2.5e-3]])
IMAGE = np.zeros((480, 640), dtype=np.uint8)
TILTS = [0.0, 30.0, 55.0]


def through(tilt_deg, lens=LENS, distance=0.06, at=(0.008, -0.006)):
    R = rotations.exp(np.radians(tilt_deg) * np.array([0.8, 0.6, 0.0]))
    offset = np.array([*at, distance])

    def to_pixel(plate):
        points = np.concatenate([plate, np.zeros((*plate.shape[:-1], 1))], axis=-1)
        return project(points @ R.T + offset, lens)

    return to_pixel


def monomials(at):
    u, v = at[..., 0], at[..., 1]
    return np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=-1)


def outline(disc, to_pixel, points=720):
    angle = 2 * np.pi * np.arange(points) / points
    return to_pixel(disc[:2] + disc[2] * np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def seen(to_pixel, discs=DISCS):
    images = images_of(discs, to_pixel)
    conics = conics_of(images)
    return conics, others_of(discs, images[:, -1], conics)


def measured(to_pixel, band=2.0, blur=0.0, discs=DISCS):
    conics, others = seen(to_pixel, discs)
    pixels = band_pixels(IMAGE, conics, band)
    return conics, pixels, measure(conics, pixels, others, 0.0, blur=blur, band=band)


@pytest.mark.parametrize("tilt_deg", TILTS)
def test_the_level_is_zero_on_the_outline(tilt_deg):
    """Exactly without lens distortion; with it, to hundredths of a pixel of twenty and more."""
    for lens, tolerance in ((LENS[:4], 1e-12), (LENS, 2e-3)):
        to_pixel = through(tilt_deg, lens)
        conics, _ = seen(to_pixel)
        for k, disc in enumerate(DISCS):
            level = monomials(outline(disc, to_pixel) - conics.origin[k]) @ conics.level[k]
            np.testing.assert_allclose(level, 0.0, atol=tolerance)


@pytest.mark.parametrize("tilt_deg", TILTS)
def test_middles_of_ellipses(tilt_deg):
    to_pixel = through(tilt_deg)
    conics, _ = seen(to_pixel)
    images = images_of(DISCS, to_pixel)
    middle = conics.origin + conics.ellipses.middle
    off = offsets_of_middles(images)
    np.testing.assert_allclose(off, middle - images[:, -1], atol=0.02)
    for k, disc in enumerate(DISCS):
        rim = outline(disc, to_pixel)
        box = (rim.min(axis=0) + rim.max(axis=0)) / 2
        np.testing.assert_allclose(middle[k], box, atol=0.02)
        reach = np.sqrt(conics.ellipses.square[[0, 2], k])
        np.testing.assert_allclose(reach, np.ptp(rim, axis=0) / 2, atol=0.02)


def test_quadratics_from_another_origin():
    rng = np.random.default_rng(3)
    level, origin, at = rng.normal(size=(5, 6)), rng.normal(size=(5, 2)), rng.normal(size=(5, 2))
    here = np.sum(monomials(at) * moved_to(level, origin), axis=-1)
    np.testing.assert_allclose(here, np.sum(monomials(at + origin) * level, axis=-1))


def nearest_on_outline(pixel, disc, to_pixel):
    """The distance of a pixel from the outline, by brute force."""
    rim = outline(disc, to_pixel, 40000)
    return np.sqrt(np.min(np.sum((rim - pixel) ** 2, axis=1)))


@pytest.mark.parametrize("tilt_deg", TILTS)
def test_distances_are_those_to_the_outline(tilt_deg):
    """To second order: what is left grows with the third power of the distance over the radius."""
    to_pixel = through(tilt_deg)
    conics, pixels, sharp = measured(to_pixel)
    _, _, blurred = measured(to_pixel, blur=0.8)
    rng = np.random.default_rng(1)
    for k, disc in enumerate(DISCS):
        for m in rng.choice(np.flatnonzero(sharp.weight[k]), 12, replace=False):
            at = conics.origin[k] + pixels.terms[1:3, k, m]
            expected = nearest_on_outline(at, disc, to_pixel)
            assert abs(sharp.distance[0, k, m]) == pytest.approx(expected, abs=0.015)
    # half of the variance times the curvature, that of a circle where nothing is tilted
    inside = (sharp.distance - blurred.distance)[0, 0][sharp.weight[0] > 0]
    assert np.all(inside > 0)
    if tilt_deg == 0.0:
        across = np.ptp(outline(DISCS[0], to_pixel), axis=0)
        assert np.median(inside) == pytest.approx(0.5 * 0.8**2 / (across.mean() / 2), rel=0.03)


@pytest.mark.parametrize("tilt_deg", TILTS)
def test_distances_follow_the_disc(tilt_deg):
    """Derivatives by shift and growth against the edges of discs that are moved a little."""
    to_pixel = through(tilt_deg)
    conics, pixels, here = measured(to_pixel)
    radius, step = DISCS[:, 2], 0.01
    for k, (dx, dy, growth) in enumerate(step * np.eye(3)):
        ends = []
        for sign in (1.0, -1.0):
            shifted = DISCS[:, :2] + sign * radius[:, None] * [dx, dy]
            discs = np.column_stack([shifted, radius * (1.0 + sign * growth)])
            moved = conics_of(images_of(discs, to_pixel))
            offset = np.moveaxis(pixels.terms[1:3], 0, -1) + (conics.origin - moved.origin)[:, None]
            terms = np.moveaxis(monomials(offset), -1, 0).astype(np.float32)
            others = others_of(discs, moved.centre, moved)
            same = replace(pixels, terms=terms)
            ends.append(measure(moved, same, others, 0.0, blur=0.0, band=2.0).distance[0])
        slope = (ends[0] - ends[1]) / (2.0 * step)
        close = (np.abs(here.distance[0]) < 1.0) & (here.weight > 0)
        largest = np.max(np.abs(slope[close]))
        assert np.max(np.abs(here.by_shift[k] - slope)[close]) < 0.03 * largest


def test_every_pixel_in_the_band_is_selected():
    to_pixel = through(40.0)
    conics, _, found = measured(to_pixel)
    u, v = np.meshgrid(np.arange(-60, 61), np.arange(-60, 61))
    for k, disc in enumerate(DISCS):
        around = conics.origin[k] + np.stack([u.ravel(), v.ravel()], axis=1)
        rim = outline(disc, to_pixel)
        apart, _ = KDTree(rim).query(around)
        assert found.weight[k].sum() == pytest.approx(np.sum(apart < 2.0), abs=4)


def test_spokes_reach_three_pixels_to_each_side_within_the_image():
    to_pixel = through(40.0)
    conics, others = seen(to_pixel)
    pixels = spoke_pixels(IMAGE, conics)
    edges = measure(conics, pixels, others, 0.0, blur=0.8, band=4.0)
    assert np.all(pixels.weight == 1.0)
    assert 2.5 < np.max(np.abs(edges.distance[0])) < 3.8
    left = conics.origin[0, 0]
    cut = spoke_pixels(np.ascontiguousarray(IMAGE[:, : int(left)]), conics)
    np.testing.assert_array_equal(cut.weight[0], pixels.terms[1, 0] < 0.0)


def test_the_nearest_other_disc_is_found_from_both_sides():
    """The gap is a fifth of a radius wide, two pixels; the distances are by brute force."""
    discs = np.array([[0.0, 0.0, 1e-3], [2.2e-3, 0.0, 1e-3], [9e-3, 9e-3, 1e-3]])
    to_pixel = through(30.0)
    conics, pixels, edges = measured(to_pixel, band=3.0, blur=1.0, discs=discs)
    assert len(edges.distance) == 2
    for k in (0, 1):
        close = np.flatnonzero((np.abs(edges.distance[1, k]) < 2.0) & (edges.weight[k] > 0))
        assert len(close) > 5
        for m in close:
            at = conics.origin[k] + pixels.terms[1:3, k, m]
            expected = nearest_on_outline(at, discs[1 - k], to_pixel)
            assert abs(edges.distance[1, k, m]) == pytest.approx(expected, abs=0.15)


def test_discs_far_apart_do_not_notice_each_other():
    _, _, edges = measured(through(0.0), band=2.0, blur=0.5)
    assert len(edges.distance) == 1
