"""The Cramer-Rao bound of the discs' centres in a simulated picture.

How much a picture tells about where a disc is follows from how its light changes when the disc is
moved on the plate. That is drawn, not derived: it holds for any lens, blur and light, and rests on
nothing that a detector does.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.special import log_ndtr, ndtr

from handeye_cli.geometry import se3
from handeye_cli.geometry.camera import project
from handeye_cli.records import Camera, FloatArray, IntArray
from handeye_cli.simulate.random_views import DiscView
from handeye_cli.simulate.render import paint_target
from handeye_cli.simulate.scenery import shade

_STEP = 0.02
"""Radii by which the discs are moved to either side."""
_ROUNDING = 1.0 / 12.0
"""Variance of rounding to whole grey levels."""
_ROUNDED_TO_LIMITS = (0.5, 254.5)
"""Light beyond is seen as black or white."""


def centre_bound(camera: Camera, view: DiscView) -> FloatArray:
    """Return the least covariance of any unbiased estimate of the discs' centres.

    All else is taken to be known: light, ink, blur, the plate's pose and the other discs. So the
    bound is the lowest that can be stated.

    Args:
        camera: The intrinsics.
        view: What is seen.

    Returns:
        (n, 2, 2) covariances of the centres in the image, square pixels.
    """
    discs = view.drawing.discs
    step = _STEP * float(np.median(discs[:, 2]))
    light, *moved = (_lit(camera, view, shift) for shift in _shifts(step))
    variance = view.appearance.noise**2 + _ROUNDING
    told = np.sqrt(told_of_light(light, math.sqrt(variance)))
    slopes = [told * (a - b) / (2 * step) for a, b in (moved[:2], moved[2:])]
    touched = np.flatnonzero(np.abs(slopes[0]) + np.abs(slopes[1]) > 0.0)
    row, column = np.divmod(touched, camera.width)
    points = np.pad(discs[:, :2], ((0, 0), (0, 1)))
    centres = _pixels(camera, view.camera_T_target, points)
    rims = _pixels(camera, view.camera_T_target, points + discs[:, 2:] * [1.0, 0.0, 0.0])
    owner = _nearest(np.stack([column, row], axis=1), centres, rims)
    x, y = (slope.ravel()[touched] for slope in slopes)
    sums = [np.bincount(owner, each, len(discs)) for each in (x * x, x * y, x * y, y * y)]
    information = np.stack(sums, axis=1).reshape(-1, 2, 2)
    ends = [_pixels(camera, view.camera_T_target, points + step * e) for e in np.eye(3)[:2]]
    begins = [_pixels(camera, view.camera_T_target, points - step * e) for e in np.eye(3)[:2]]
    by_plate = np.stack([a - b for a, b in zip(ends, begins, strict=True)], axis=-1) / (2 * step)
    spread = variance * np.linalg.inv(information)
    return np.asarray(by_plate @ spread @ np.swapaxes(by_plate, -1, -2))


def told_of_light(light: FloatArray, noise: float) -> FloatArray:
    """Return the (...) Fisher information that clipped pixels keep, over that of unclipped ones.

    With z noises from the light to a limit, light within tells Phi(z) - z phi(z), and that a pixel
    is at the limit tells phi(z)^2 / Phi(-z) (Tobin 1958).

    Args:
        light: (...) grey levels before noise, rounding and clipping.
        noise: Standard deviation of a grey level.
    """
    told = np.ones_like(light)
    low, high = _ROUNDED_TO_LIMITS
    for z in ((light - low) / noise, (high - light) / noise):
        log_density = -0.5 * z * z - 0.5 * math.log(2.0 * math.pi)
        told += ndtr(z) - z * np.exp(log_density) + np.exp(2.0 * log_density - log_ndtr(-z)) - 1.0
    return np.clip(told, 0.0, 1.0)


def _nearest(pixels: IntArray, centres: FloatArray, rims: FloatArray) -> IntArray:
    """Return the (m,) disc whose edge is nearest to each of (m, 2) pixels, nearly."""
    radius = np.linalg.norm(rims - centres, axis=1)
    apart = np.linalg.norm(pixels[:, None] - centres, axis=-1)
    return np.asarray(np.argmin(np.abs(apart - radius), axis=1))


def _shifts(step: float) -> FloatArray:
    return step * np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])


def _lit(camera: Camera, view: DiscView, shift: FloatArray) -> FloatArray:
    drawing = replace(view.drawing, discs=view.drawing.discs + shift)
    light = paint_target(camera, view.camera_T_target, drawing, appearance=view.appearance)
    middle = _pixels(
        camera, view.camera_T_target, np.pad(view.drawing.discs[:, :2], ((0, 0), (0, 1)))
    )
    return light * shade(camera, view.scenery, middle.mean(axis=0))


def _pixels(camera: Camera, pose: FloatArray, points: FloatArray) -> FloatArray:
    return project(se3.transform_points(pose, points), camera.parameters, camera.model)
