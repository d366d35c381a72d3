"""The Cramer-Rao bound of the discs' centres in a simulated picture.

How much a picture tells about where a disc is follows from how its light changes when the disc is
moved on the plate. That is drawn, not derived: it holds for any lens, blur and light, and rests on
nothing that a detector does.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

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
    heard = light < 255.0
    slopes = [np.where(heard, (a - b) / (2 * step), 0.0) for a, b in (moved[:2], moved[2:])]
    touched = np.flatnonzero(np.abs(slopes[0]) + np.abs(slopes[1]) > 0.0)
    row, column = np.divmod(touched, camera.width)
    points = np.pad(discs[:, :2], ((0, 0), (0, 1)))
    centres = _pixels(camera, view.camera_T_target, points)
    rims = _pixels(camera, view.camera_T_target, points + discs[:, 2:] * [1.0, 0.0, 0.0])
    owner = _nearest(np.stack([column, row], axis=1), centres, rims)
    x, y = (slope.ravel()[touched] for slope in slopes)
    sums = [np.bincount(owner, each, len(discs)) for each in (x * x, x * y, x * y, y * y)]
    information = np.stack(sums, axis=1).reshape(-1, 2, 2)
    variance = view.appearance.noise**2 + _ROUNDING
    ends = [_pixels(camera, view.camera_T_target, points + step * e) for e in np.eye(3)[:2]]
    begins = [_pixels(camera, view.camera_T_target, points - step * e) for e in np.eye(3)[:2]]
    by_plate = np.stack([a - b for a, b in zip(ends, begins, strict=True)], axis=-1) / (2 * step)
    spread = variance * np.linalg.inv(information)
    return np.asarray(by_plate @ spread @ np.swapaxes(by_plate, -1, -2))


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
