"""Where points of a target's plane lie in an image, from the points that were found in it."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from handeye_cli.geometry import pnp
from handeye_cli.geometry.camera import PlateToPixel, distort, normalise
from handeye_cli.geometry.extent import middle_of
from handeye_cli.records import Camera, FloatArray
from handeye_cli.targets.linear_homography import linear_homography

_CLOSE = 1e-7
"""Error of the directions of found points, which are good to 1e-5 at best."""
_COEFFICIENTS, _UNTIL_CLOSE = 12, (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 1e-6)
"""How many coefficients OpenCV is given, and when it stops, in pixels."""
_undistort: Any = getattr(cv2, "undistortPointsIter", cv2.undistortPoints)
"""OpenCV 4 has another name for the one that can be told when to stop."""
_ENOUGH = 25
"""Points from which on a cubic with 10 coefficients is well determined."""


def plate_map(plate: FloatArray, pixels: FloatArray, camera: Camera | None) -> PlateToPixel:
    """Return the map from a target's plane to pixels that fits points of it best.

    Args:
        plate: (n, 2) points in the target's plane, metres; at least four, not on one line.
        pixels: (n, 2) their images.
        camera: Intrinsics; without them a cubic over the plane stands for the distortion, where
            there are points enough.

    Returns:
        A function of (..., 2) points of the plane, metres, that gives their (..., 2) pixels.
    """
    directions = None if camera is None else _directions(pixels, camera)
    # A lens that leaves pixels without a direction cannot be right: as good as none.
    if camera is None or directions is None or not np.all(np.isfinite(directions)):
        H = _homography(plate, pixels)
        return _bent(H, plate, pixels) if len(plate) >= _ENOUGH else lambda p: _projective(H, p)
    H, parameters, model = _homography(plate, directions), camera.parameters, camera.model
    focal, middle, distortion = parameters[:2], parameters[2:4], parameters[4:]
    return lambda p: distort(_projective(H, p), distortion, model) * focal + middle


@np.errstate(over="ignore", invalid="ignore")
def _directions(pixels: FloatArray, camera: Camera) -> FloatArray:
    """Return the (n, 2) directions of pixels on the plane z = 1, NaN where there is none.

    OpenCV takes a tenth of the time of the kernel, but does not say where it fails.
    """
    parameters, distortion = camera.parameters, np.array(camera.distortion)
    if camera.model != "equidistant" and len(distortion) > 0:
        (fx, fy), (cx, cy) = focal, middle = parameters[:2], parameters[2:4]
        matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
        lens = np.zeros(_COEFFICIENTS)
        lens[: len(distortion)] = distortion
        given = np.ascontiguousarray(pixels, dtype=np.float64)
        found = _undistort(given, matrix, lens, R=None, P=None, criteria=_UNTIL_CLOSE)
        directions = np.asarray(found, dtype=np.float64).reshape(pixels.shape)
        missed = distort(directions, distortion, camera.model) - (pixels - middle) / focal
        # false for what is not a number, too
        if np.max(np.abs(missed)) < _CLOSE:
            return directions
    return normalise(pixels, parameters, camera.model, tolerance=_CLOSE)


def _homography(plate: FloatArray, image: FloatArray) -> FloatArray:
    """Return the (3, 3) map from a plane to an image that fits points best.

    The batched kernel takes more time, but has an answer for points on one line, too.
    """
    found = linear_homography(plate, image)
    if found is not None:
        return found
    return pnp.homography(plate, image, np.ones(len(plate), dtype=bool))


def _bent(H: FloatArray, plate: FloatArray, pixels: FloatArray) -> PlateToPixel:
    """Return a homography and a cubic for what it misses."""
    middle, extent = middle_of(plate), np.ptp(plate, axis=0).max() / 2
    terms = _cubic_terms((plate - middle) / extent)
    missed, *_ = np.linalg.lstsq(terms, pixels - _projective(H, plate), rcond=None)
    return lambda p: _projective(H, p) + _cubic_terms((p - middle) / extent) @ missed


def _cubic_terms(at: FloatArray) -> FloatArray:
    x, y = at[..., 0], at[..., 1]
    one, xx, xy, yy = np.ones_like(x), x * x, x * y, y * y
    return np.stack([one, x, y, xx, xy, yy, xx * x, xx * y, x * yy, yy * y], axis=-1)


def _projective(H: FloatArray, plate: FloatArray) -> FloatArray:
    # as rows of coordinates, which is twice as fast as point by point
    mapped = H[:, :2] @ plate.reshape(-1, 2).T + H[:, 2:]
    return np.asarray((mapped[:2] / mapped[2]).T.reshape(plate.shape))
