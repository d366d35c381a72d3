"""The pixels around the edges of discs, and where they lie on the plate.

Near each disc the map from pixels back to the plate is a cubic polynomial, so neither perspective
nor lens distortion has to be inverted pixel by pixel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.camera import PlateToPixel
from handeye_cli.geometry.ring_pixels import Padding, ring_pixels

FloatArray = NDArray[np.float64]
SingleArray = NDArray[np.float32]
IntArray = NDArray[np.int64]

_NEIGHBOURS = 4
_POWERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3))
"""Exponents of the cubic's monomials, the quadratic's first."""
_KNOTS = 5
"""Points along each side of the square that the cubic is fitted to."""
_SLACK = 0.4
"""How much farther than asked for pixels are taken, as outlines are not quite ellipses."""


def _derivatives() -> FloatArray:
    """Return (2, 10, 6): derivatives of the cubic's monomials by u and v, as quadratics."""
    out = np.zeros((2, len(_POWERS), 6))
    for row, (i, j) in enumerate(_POWERS):
        if i:
            out[0, row, _POWERS.index((i - 1, j))] = i
        if j:
            out[1, row, _POWERS.index((i, j - 1))] = j
    return out


_BY_PIXEL = _derivatives()


@dataclass(frozen=True)
class Patches:
    """Where discs lie in an image, and the way back to the plate around each.

    Attributes:
        middle: (n, 2) whole pixel nearest to each centre.
        half: Pixels that the windows around the middles reach to each side.
        cubic: (n, 2, 10) from the offset to a middle, in `half`, to the plate, in radii from the
            disc's centre.
        slopes: (n, 4, 6) derivatives of the plate's x, y by the pixel's u, then by its v.
        bends: (n, 2, 3) second derivatives of the plate's x, y at the middle: by u twice, twice the
            mixed one, by v twice.
        others: (n, k, 3) the nearest discs, up to 4: centre from this one's, and radius, in radii.
        gap: Smallest distance between the edges of two discs, pixels.
    """

    middle: IntArray
    half: int
    cubic: SingleArray
    slopes: SingleArray
    bends: SingleArray
    others: SingleArray
    gap: float


@dataclass(frozen=True)
class EdgePixels:
    """The m pixels at most near the edge of each disc; components come before the pixels.

    Attributes:
        grey: (n, m) grey levels.
        weight: (n, m) 1 for a pixel, 0 for padding.
        terms: (n, 10, m) monomials 1, u, v, uu, uv, vv, ... of the offset from the window's
            middle, in half widths.
        plate: (n, 2, m) on the plate, in radii from the disc's first centre.
        slopes: (n, 4, m) derivatives of the plate's x and y by the pixel's u, then by its v.
        half: Half width of the windows, pixels.
    """

    grey: SingleArray
    weight: SingleArray
    terms: SingleArray
    plate: SingleArray
    slopes: SingleArray
    half: int


def forward_jacobian(to_pixel: PlateToPixel, at: FloatArray, radius: FloatArray) -> FloatArray:
    """Return the (n, 2, 2) derivatives of the map, by central differences over a tenth radius."""
    step = 0.1 * radius[:, None, None] * np.concatenate([np.eye(2), -np.eye(2)])
    ends = to_pixel(at[:, None] + step)
    return np.asarray(
        np.swapaxes(ends[:, :2] - ends[:, 2:], -1, -2) / (0.2 * radius[:, None, None])
    )


def look_at(discs: FloatArray, to_pixel: PlateToPixel, start: FloatArray, band: float) -> Patches:
    """Prepare the surroundings of each disc.

    Args:
        discs: (n, 3) centre (x, y) on the plate and radius of each disc, metres.
        to_pixel: Map of (..., 2) plate points to (..., 2) pixels.
        start: (n, 2) where the centres are in the image; each disc's map is moved there.
        band: How far beyond the edges pixels are going to be taken, pixels.
    """
    radius = discs[:, 2]
    jacobian = radius[:, None, None] * forward_jacobian(to_pixel, discs[:, :2], radius)
    long, short = half_axes(jacobian)
    half = math.ceil(float(np.max(long)) + band)
    middle = np.rint(start).astype(np.int64)
    missed = np.asarray(start - to_pixel(discs[:, :2]), dtype=float)
    cubic = _inverse_cubic(discs, to_pixel, missed - middle, 1.2 + band / short, half)
    others = _nearest_discs(discs)
    apart = np.sqrt(np.sum(others[..., :2] ** 2, axis=-1)) - others[..., 2] - 1.0
    slopes = (cubic[:, None] @ _BY_PIXEL / half).reshape(len(discs), 4, 6)
    return Patches(
        middle=middle,
        half=half,
        cubic=cubic.astype(np.float32),
        slopes=slopes.astype(np.float32),
        bends=(2.0 / half**2 * cubic[:, :, 3:6]).astype(np.float32),
        others=others.astype(np.float32),
        gap=float(np.min(np.min(apart, axis=1) * short)),
    )


def half_axes(jacobian: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (n,) half axes of the ellipses of (n, 2, 2) matrices, the longer ones first."""
    (a, b), (c, d) = np.moveaxis(jacobian, (1, 2), (0, 1))
    mean, difference = np.hypot(a + d, b - c) / 2, np.hypot(a - d, b + c) / 2
    return mean + difference, np.abs(mean - difference)


def _inverse_cubic(
    discs: FloatArray, to_pixel: PlateToPixel, shift: FloatArray, reach: FloatArray, half: int
) -> FloatArray:
    """Return the (n, 2, 10) cubics from a window's offsets to the plate, in radii."""
    ticks = np.cos(np.pi * (np.arange(_KNOTS) + 0.5) / _KNOTS)
    grid = np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2)
    local = reach[:, None, None] * grid
    pixels = to_pixel(discs[:, None, :2] + discs[:, None, 2:] * local) + shift[:, None]
    terms = _monomials(pixels[..., 0] / half, pixels[..., 1] / half)
    cubic = np.linalg.solve(terms @ np.swapaxes(terms, -1, -2), terms @ local)
    return np.swapaxes(cubic, -1, -2)


def _monomials(x: NDArray[np.floating], y: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the (n, 10, m) monomials at (n, m) places."""
    out = np.empty((len(x), len(_POWERS), x.shape[1]), dtype=x.dtype)
    out[:, 0], out[:, 1], out[:, 2] = 1.0, x, y
    np.multiply(x, x, out=out[:, 3])
    np.multiply(x, y, out=out[:, 4])
    np.multiply(y, y, out=out[:, 5])
    np.multiply(out[:, 3:6], x[:, None], out=out[:, 6:9])
    np.multiply(out[:, 5], y, out=out[:, 9])
    return out


def _nearest_discs(discs: FloatArray) -> FloatArray:
    apart = np.sum((discs[:, None, :2] - discs[None, :, :2]) ** 2, axis=-1)
    count = min(_NEIGHBOURS, len(discs) - 1)
    nearest = np.argpartition(apart, count, axis=1)[:, : count + 1]
    order = np.argsort(np.take_along_axis(apart, nearest, 1), axis=1)[:, 1:]
    relative = discs[np.take_along_axis(nearest, order, 1)]
    relative[..., :2] -= discs[:, None, :2]
    return np.asarray(relative / discs[:, None, None, 2])


def edge_pixels(
    image: NDArray[np.uint8],
    patches: Patches,
    rings: FloatArray,
    band: float,
    *,
    every: int = 1,
) -> EdgePixels:
    """Select the pixels within a band around the edges of the discs.

    Args:
        image: (height, width) grey image.
        patches: The surroundings of the discs.
        rings: (n, k, 2) points of the discs' outlines in the image.
        band: Half of the band's width, pixels.
        every: Every so many pixels are taken, evenly over both directions.
    """
    column, row, count = ring_pixels(rings, image.shape, band + _SLACK, every=every)
    u = (column - np.repeat(patches.middle[:, 0], count)).astype(np.float32)
    v = (row - np.repeat(patches.middle[:, 1], count)).astype(np.float32)
    padding, half = Padding(count), np.float32(patches.half)
    terms = _monomials(padding.rows(u / half), padding.rows(v / half))
    grey = image.ravel()[row * image.shape[1] + column]
    return EdgePixels(
        grey=padding.rows(grey.astype(np.float32)),
        weight=padding.weight,
        terms=terms,
        plate=patches.cubic @ terms,
        slopes=patches.slopes @ terms[:, :6],
        half=patches.half,
    )
