"""Outlines of discs in an image as conics, and how they move with the discs.

Through a camera without distortion a circle is imaged as an ellipse: the zeros of a quadratic
polynomial of the pixel, the level, that falls below zero inside. Lens distortion within a disc
moves its outline as a whole, which the ellipse follows, and bends it by thousandths of a pixel,
evenly to both sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.camera import PlateToPixel
from handeye_cli.geometry.ring_pixels import Ellipses
from handeye_cli.geometry.two_by_two import mapped_back

FloatArray = NDArray[np.float64]

_RIM = 16
_ANGLE = 2.0 * np.pi * np.arange(_RIM) / _RIM
_X, _Y, _ONE = np.cos(_ANGLE), np.sin(_ANGLE), np.ones(_RIM)
_PLACES = np.stack([np.append(_X, 0.0), np.append(_Y, 0.0)], axis=1)
"""Points around a disc and its centre: (17, 2)."""
_ANALYSIS = np.stack([_X, _Y, _X * _X - _Y * _Y, 2.0 * _X * _Y, 0.5 * _ONE], axis=1) * 2.0 / _RIM
"""From images of the points around to the coefficients of x, y, xx - yy, 2 xy and 1: (16, 5)."""
_BY_X = np.stack([_ONE, 0.0 * _ONE, 2.0 * _X, 2.0 * _Y, 2.0 * _X])
_BY_Y = np.stack([0.0 * _ONE, _ONE, -2.0 * _Y, 2.0 * _X, 2.0 * _Y])
"""Derivatives of these terms, and of xx + yy, by x and y at the points around: (5, 16)."""
_DERIVATIVES = np.concatenate([_BY_X, _BY_Y], axis=1)
_ALONG = np.roll(np.eye(_RIM), 1, axis=0) - np.roll(np.eye(_RIM), -1, axis=0)
"""From points around to the differences of the two beside each: (16, 16)."""
_SLOPES = np.array([[1, 3, 4], [2, 4, 5]])
_TIMES = np.array([[1.0, 2.0, 1.0], [1.0, 1.0, 2.0]])
"""Which coefficients of a quadratic are in its derivatives by u and v, and how many times."""


@dataclass(frozen=True)
class Conics:
    """The outlines of n discs in an image.

    Attributes:
        centre: (n, 2) images of the discs' centres.
        origin: (n, 2) the nearest whole pixels, from which all others (u, v) are counted.
        level: (n, 6) coefficients of 1, u, v, uu, uv, vv: -1 at the origin, 0 on the outline.
        rising: (n, 2, 6) the same of the level's fall, on the outline, when the disc is shifted
            along the plate's axes, by its radius.
        by_shift: (n, 2, 2) derivatives of the image of the centre by these shifts.
        rim: (n, 2, 16) points on the outlines.
        outward: (n, 2, 16) unit normals there.
        ellipses: Middles and axes.
    """

    centre: FloatArray
    origin: FloatArray
    level: FloatArray
    rising: FloatArray
    by_shift: FloatArray
    rim: FloatArray
    outward: FloatArray
    ellipses: Ellipses


@dataclass(frozen=True)
class PlateInView:
    """The discs of a plate and how they are imaged.

    Attributes:
        discs: (n, 3) centre (x, y) on the plate and radius of each disc, metres.
        to_pixel: Map of (..., 2) plate points to (..., 2) pixels.
    """

    discs: FloatArray
    to_pixel: PlateToPixel

    @cached_property
    def images(self) -> FloatArray:
        """(n, 17, 2) pixels of 16 points around each disc and of its centre."""
        return images_of(self.discs, self.to_pixel)


def images_of(discs: FloatArray, to_pixel: PlateToPixel) -> FloatArray:
    """Return the (n, 17, 2) pixels of 16 points around each disc and of its centre.

    Args:
        discs: (n, 3) centre (x, y) on the plate and radius, metres.
        to_pixel: Map of (..., 2) plate points to (..., 2) pixels.
    """
    return to_pixel(discs[:, None, :2] + discs[:, 2, None, None] * _PLACES)


def local_maps(images: FloatArray) -> FloatArray:
    """Return how discs are imaged, from the (n, 17, 2) images of their points.

    Returns:
        (n, 2, 6) coefficients of 1, x, y, xx - yy, 2 xy and xx + yy, in radii from the centre.
    """
    around = images.transpose(0, 2, 1)
    centre, parts = around[..., -1:], around[..., :-1] @ _ANALYSIS
    parts[..., -1:] -= centre
    return np.concatenate([centre, parts], axis=-1)


def offsets_of_middles(images: FloatArray) -> FloatArray:
    """Return the (n, 2) offsets from the centres' images to the middles of the outlines' ellipses.

    Mapped back by what the images have in common with a linear map, an outline is nearly a circle,
    whose middle is found from the radii all around.
    """
    directions = _PLACES[:-1]
    rim = images[:, :-1] - images[:, -1:]
    linear = 2.0 / _RIM * (rim.transpose(0, 2, 1) @ directions)
    back = mapped_back(linear[:, None], rim)
    radius = back[..., 0] * _X + back[..., 1] * _Y
    middle = 2.0 / _RIM * (radius @ directions)
    return np.asarray((linear @ middle[..., None])[..., 0])


def conics_of(images: FloatArray) -> Conics:
    """Fit conics to the (n, 17, 2) images of points of discs, as `images_of` has them."""
    centre = images[:, -1]
    origin = np.rint(centre)
    around = (images - origin[:, None]).transpose(0, 2, 1)
    rim = around[..., :-1]
    terms = np.empty((len(images), 5, _RIM))
    terms[:, :2] = rim
    np.multiply(rim, rim[:, :1], out=terms[:, 2:4])
    np.multiply(rim[:, 1], rim[:, 1], out=terms[:, 4])
    # distances from the conic count all along the outline alike
    along = rim @ _ALONG
    weighted = terms / np.hypot(along[:, 0], along[:, 1])[:, None]
    fitting = np.linalg.inv(weighted @ terms.transpose(0, 2, 1)) @ weighted
    level = np.empty((len(images), 6))
    level[:, 0], level[:, 1:] = -1.0, fitting @ _ONE
    slopes = slopes_of(level)
    steepest = slopes[..., 1:] @ rim
    steepest += slopes[..., :1]
    field = rim @ _ANALYSIS
    field[..., -1] -= around[..., -1]
    by_place = (field @ _DERIVATIVES).reshape(-1, 2, 2, _RIM)
    by_place *= steepest[:, :, None]
    rising = np.zeros((len(images), 2, 6))
    np.matmul(by_place[:, 0] + by_place[:, 1], fitting.transpose(0, 2, 1), out=rising[..., 1:])
    outward = steepest / np.hypot(steepest[:, 0], steepest[:, 1])[:, None]
    ellipses = _ellipses(slopes)
    return Conics(centre, origin, level, rising, field[..., :2], rim, outward, ellipses)


def _ellipses(slopes: FloatArray) -> Ellipses:
    """Return the ellipses of levels that are -1 at the origin, by their (n, 2, 3) slopes."""
    (a, uu, uv), (b, _, vv) = slopes.transpose(1, 2, 0)
    determinant = uu * vv - uv * uv
    u, v = (uv * b - vv * a) / determinant, (uv * a - uu * b) / determinant
    scale = (2.0 - a * u - b * v) / determinant
    return Ellipses.of(np.array([u, v]).T, np.array([vv * scale, -uv * scale, uu * scale]))


def slopes_of(level: FloatArray) -> FloatArray:
    """Return (..., 2, 3) coefficients of 1, u, v in the derivatives of (..., 6) quadratics."""
    return np.asarray(level[..., _SLOPES] * _TIMES)


def moved_to(level: FloatArray, origin: FloatArray) -> FloatArray:
    """Return (..., 6) quadratics for pixels counted from another (..., 2) origin."""
    slopes = slopes_of(level)
    change = (slopes[..., 1:] @ origin[..., None])[..., 0]
    out = level.copy()
    moved = origin * (slopes[..., 0] + 0.5 * change)
    out[..., 0] += moved[..., 0] + moved[..., 1]
    out[..., 1:3] += change
    return out
