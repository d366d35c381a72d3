"""The camera model: points in the camera frame to pixels and back, with derivatives.

Parameters are one array (fx, fy, cx, cy, *distortion). The distortion follows OpenCV:
`plumb_bob` and `rational_polynomial` take k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4]]], `equidistant`
takes k1 k2 k3 k4 of the angle to the optical axis. Missing coefficients are zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
PlateToPixel = Callable[[FloatArray], FloatArray]
"""Map of (..., 2) points of a target's plane, metres, to their (..., 2) pixels."""

_PLUMB_BOB_SIZE = 12
_EQUIDISTANT_SIZE = 4
_NEWTON_STEPS = 25
_HIT = 1e-9
"""Error on the plane z = 1 within which a direction has the pixel as its image."""


@dataclass(frozen=True)
class Lens:
    """Intrinsics and what they mean.

    Attributes:
        parameters: (4 + k,) fx, fy, cx, cy and the distortion.
        model: Name of the distortion model, as in ROS.
    """

    parameters: FloatArray
    model: str = "plumb_bob"


@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def project(points: FloatArray, parameters: FloatArray, model: str = "plumb_bob") -> FloatArray:
    """Return the pixels of points in the camera frame.

    Args:
        points: (..., 3) points in metres, in front of the camera.
        parameters: (4 + k,) intrinsics.
        model: Name of the distortion model, as in ROS.

    Returns:
        (..., 2) pixels.
    """
    distorted = distort(points[..., :2] / points[..., 2:], parameters[4:], model)
    return np.asarray(distorted * parameters[:2] + parameters[2:4])


@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def project_jacobians(
    points: FloatArray, parameters: FloatArray, model: str = "plumb_bob"
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return pixels with their derivatives by the points and by the intrinsics.

    Args:
        points: (..., 3) points in the camera frame in metres.
        parameters: (4 + k,) intrinsics.
        model: Name of the distortion model.

    Returns:
        (..., 2) pixels, (..., 2, 3) derivatives by the point, (..., 2, 4 + k) by the parameters.
    """
    normal = points[..., :2] / points[..., 2:]
    distorted, by_normal, by_coefficients = distort_jacobians(normal, parameters[4:], model)
    focal = parameters[:2]
    by_point = np.zeros((*points.shape[:-1], 2, 3))
    by_point[..., 0, 0] = by_point[..., 1, 1] = 1.0
    by_point[..., 2] = -normal
    by_point = focal[:, None] * (by_normal @ (by_point / points[..., 2, None, None]))
    by_parameters = np.zeros((*points.shape[:-1], 2, parameters.size))
    by_parameters[..., 0, 0], by_parameters[..., 1, 1] = distorted[..., 0], distorted[..., 1]
    by_parameters[..., 0, 2] = by_parameters[..., 1, 3] = 1.0
    by_parameters[..., 4:] = focal[:, None] * by_coefficients
    return distorted * focal + parameters[2:4], by_point, by_parameters


@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def normalise(
    pixels: FloatArray,
    parameters: FloatArray,
    model: str = "plumb_bob",
    *,
    tolerance: float = 1e-14,
) -> FloatArray:
    """Return the undistorted directions (x / z, y / z) of pixels, by Newton's method.

    Args:
        pixels: (..., 2) pixels.
        parameters: (4 + k,) intrinsics.
        model: Name of the distortion model.
        tolerance: Error on the plane z = 1 that is small enough.

    Returns:
        (..., 2) coordinates on the plane z = 1; NaN where no direction has this pixel as image.
    """
    wanted = (pixels - parameters[2:4]) / parameters[:2]
    if model == "equidistant":
        return _undistort_equidistant(wanted, parameters[4:])
    if not np.any(parameters[4:]):
        return np.asarray(wanted)
    k = _plumb_bob(parameters[4:])
    xy = wanted
    for _ in range(_NEWTON_STEPS):
        distorted, slope = _distort_and_slope(xy, k)
        error = distorted - wanted
        if np.max(np.abs(error), initial=0.0) < tolerance:
            break
        xy = xy - _solve2(slope, error)
    else:
        distorted, slope = _distort_and_slope(xy, k)
    hit = np.max(np.abs(distorted - wanted), axis=-1) <= max(tolerance, _HIT)
    # Beyond its fold the model maps a second, mirrored direction to the same pixel.
    (a, b), (c, d) = np.moveaxis(slope, (-2, -1), (0, 1))
    unfolded = (a * d - b * c > 0) & (a + d > 0)
    return np.where((hit & unfolded)[..., None], xy, np.nan)


def _undistort_equidistant(wanted: FloatArray, coefficients: FloatArray) -> FloatArray:
    """Invert the equidistant model: Newton's method on the angle to the axis alone."""
    k = _padded(coefficients, _EQUIDISTANT_SIZE)
    radius = np.linalg.norm(wanted, axis=-1)
    theta = np.minimum(radius, 0.5 * np.pi)
    for _ in range(_NEWTON_STEPS):
        powers = theta[..., None] ** np.array([2, 4, 6, 8])
        slope = 1 + powers @ (k * np.array([3, 5, 7, 9]))
        theta = theta - (theta * (1 + powers @ k) - radius) / np.where(slope > 0, slope, np.nan)
    bent = theta * (1 + theta[..., None] ** np.array([2, 4, 6, 8]) @ k)
    valid = (np.abs(bent - radius) <= _HIT) & (theta < 0.5 * np.pi)
    gain = np.where(radius > 1e-12, np.tan(theta) / np.maximum(radius, 1e-12), 1.0)
    return np.where(valid[..., None], wanted * gain[..., None], np.nan)


def _solve2(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    a, b = matrix[..., 0, 0], matrix[..., 0, 1]
    c, d = matrix[..., 1, 0], matrix[..., 1, 1]
    determinant = a * d - b * c
    safe = np.where(np.abs(determinant) < 1e-12, np.nan, determinant)
    u, v = vector[..., 0], vector[..., 1]
    return np.stack([(d * u - b * v) / safe, (a * v - c * u) / safe], axis=-1)


def distort(xy: FloatArray, coefficients: FloatArray, model: str) -> FloatArray:
    """Return distorted directions.

    Args:
        xy: (..., 2) undistorted coordinates on the plane z = 1.
        coefficients: (k,) of the model.
        model: Name of the distortion model.
    """
    if model == "equidistant":
        return _equidistant(xy, _padded(coefficients, _EQUIDISTANT_SIZE))[0]
    return _distort(xy, _plumb_bob(coefficients))


def distort_jacobians(
    xy: FloatArray, coefficients: FloatArray, model: str
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return distorted directions with their derivatives.

    Args:
        xy: (..., 2) undistorted coordinates on the plane z = 1.
        coefficients: (k,) of the model.
        model: Name of the distortion model.

    Returns:
        (..., 2) distorted coordinates, (..., 2, 2) derivatives by `xy`, (..., 2, k) by the
        coefficients.
    """
    if model == "equidistant":
        out, by_xy, by_k = _equidistant(xy, _padded(coefficients, _EQUIDISTANT_SIZE))
    else:
        k = _plumb_bob(coefficients)
        out, by_xy = _distort_and_slope(xy, k)
        by_k = _by_coefficients(xy, k)
    return out, by_xy, by_k[..., : coefficients.size]


def _padded(coefficients: FloatArray, size: int) -> FloatArray:
    return np.concatenate([coefficients, np.zeros(size - coefficients.size)])


def _plumb_bob(coefficients: FloatArray) -> list[float]:
    """Return all twelve coefficients, as numbers: arrays of one are slow."""
    return [*coefficients.tolist(), *[0.0] * (_PLUMB_BOB_SIZE - coefficients.size)]


class _Radial(NamedTuple):
    """What the radial part needs at a direction: powers of the radius, gain, and denominator."""

    r2: FloatArray
    r4: FloatArray
    gain: FloatArray
    below: FloatArray | float

    @classmethod
    def of(cls, x: FloatArray, y: FloatArray, k: list[float]) -> _Radial:
        r2 = x * x + y * y
        above = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))
        below = 1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])) if any(k[5:8]) else 1.0
        return cls(r2, r2 * r2, above / below if any(k[5:8]) else above, below)


def _distort(xy: FloatArray, k: list[float]) -> FloatArray:
    # apart, each in a row, as most directions come by the hundred
    x, y = xy[..., 0].copy(), xy[..., 1].copy()
    return _distorted(x, y, _Radial.of(x, y, k), k)


def _distorted(x: FloatArray, y: FloatArray, radial: _Radial, k: list[float]) -> FloatArray:
    _, _, p1, p2, *_, s1, s2, s3, s4 = k
    r2 = radial.r2
    u, v = x * radial.gain, y * radial.gain
    if p1 or p2:
        xy2 = 2 * x * y
        u += p1 * xy2 + p2 * (r2 + 2 * x * x)
        v += p1 * (r2 + 2 * y * y) + p2 * xy2
    if any(k[8:]):
        u += s1 * r2 + s2 * radial.r4
        v += s3 * r2 + s4 * radial.r4
    out = np.empty((*x.shape, 2))
    out[..., 0], out[..., 1] = u, v
    return out


def _distort_and_slope(xy: FloatArray, k: list[float]) -> tuple[FloatArray, FloatArray]:
    """Return (..., 2) distorted directions and their (..., 2, 2) derivatives by `xy`."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = k
    x, y = xy[..., 0].copy(), xy[..., 1].copy()
    radial = _Radial.of(x, y, k)
    r2, gain = radial.r2, radial.gain
    slope = k1 + r2 * (2 * k2 + 3 * k3 * r2) - gain * (k4 + r2 * (2 * k5 + 3 * k6 * r2))
    twice = 2 * slope / radial.below
    prism_u, prism_v = 2 * (s1 + 2 * s2 * r2), 2 * (s3 + 2 * s4 * r2)
    cross = twice * x * y + 2 * (p1 * x + p2 * y)
    by_xy = np.empty((*xy.shape, 2))
    by_xy[..., 0, 0] = gain + twice * x * x + 2 * p1 * y + 6 * p2 * x + prism_u * x
    by_xy[..., 0, 1] = cross + prism_u * y
    by_xy[..., 1, 0] = cross + prism_v * x
    by_xy[..., 1, 1] = gain + twice * y * y + 6 * p1 * y + 2 * p2 * x + prism_v * y
    return _distorted(x, y, radial, k), by_xy


def _by_coefficients(xy: FloatArray, k: list[float]) -> FloatArray:
    """Return the (..., 2, 12) derivatives of distorted directions by the coefficients."""
    x, y = xy[..., 0], xy[..., 1]
    radial = _Radial.of(x, y, k)
    r2, r4, gain, below = radial.r2, radial.r4, radial.gain, radial.below
    r6 = r2 * r4
    share = np.stack([r2, r4, r6, -gain * r2, -gain * r4, -gain * r6], axis=-1)
    share = share / np.broadcast_to(below, r2.shape)[..., None]
    by_k = np.zeros((*xy.shape, _PLUMB_BOB_SIZE))
    by_k[..., [0, 1, 4, 5, 6, 7]] = xy[..., None] * share[..., None, :]
    by_k[..., 0, 2], by_k[..., 1, 2] = 2 * x * y, r2 + 2 * y * y
    by_k[..., 0, 3], by_k[..., 1, 3] = r2 + 2 * x * x, 2 * x * y
    by_k[..., 0, 8], by_k[..., 0, 9] = r2, r4
    by_k[..., 1, 10], by_k[..., 1, 11] = r2, r4
    return by_k


def _equidistant(xy: FloatArray, k: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    r2 = np.sum(xy * xy, axis=-1)
    radius = np.sqrt(r2)
    small = radius < 1e-6
    safe = np.where(small, 1.0, radius)
    theta = np.arctan(radius)
    powers = theta[..., None] ** np.array([2, 4, 6, 8])
    turned = theta * (1 + powers @ k)
    gain = np.where(small, 1.0, turned / safe)
    turned_slope = (1 + powers @ (k * np.array([3, 5, 7, 9]))) / (1 + r2)
    gain_slope = np.where(small, 0.0, (turned_slope - gain) / safe**2)
    by_xy = gain[..., None, None] * np.eye(2) + gain_slope[..., None, None] * (
        xy[..., :, None] * xy[..., None, :]
    )
    unit = np.where(small, 1.0, theta / safe)
    by_k = xy[..., None] * (unit[..., None] * powers)[..., None, :]
    return xy * gain[..., None], by_xy, by_k
