"""The pixels around the edges of discs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.camera import PlateToPixel
from handeye_cli.geometry.disc_conics import Conics
from handeye_cli.geometry.ring_pixels import INSIDE, ring_pixels
from handeye_cli.geometry.sensor_limits import IntArray, at_limits

FloatArray = NDArray[np.float64]
SingleArray = NDArray[np.float32]

_SPOKE = np.arange(-3.0, 4.0)
"""Steps across the edge, pixels."""
_SLACK = 0.3
"""How much farther than asked for pixels are taken, as outlines are not quite ellipses."""


@dataclass(frozen=True)
class EdgePixels:
    """The m pixels at most near the edge of each of n discs.

    Attributes:
        grey: (n, m) grey levels.
        weight: (n, m) 1 for a pixel, 0 for padding.
        terms: (6, n, m) monomials 1, u, v, uu, uv, vv of the offset from the disc's origin.
        at_limits: (k,) where they are black or white, counted row by row.
    """

    grey: SingleArray
    weight: SingleArray
    terms: SingleArray
    at_limits: IntArray


def forward_jacobian(to_pixel: PlateToPixel, at: FloatArray, radius: FloatArray) -> FloatArray:
    """Return the (n, 2, 2) derivatives of the map, by central differences over a tenth radius."""
    step = 0.1 * radius[:, None, None] * np.concatenate([np.eye(2), -np.eye(2)])
    ends = to_pixel(at[:, None] + step)
    return np.asarray(
        np.swapaxes(ends[:, :2] - ends[:, 2:], -1, -2) / (0.2 * radius[:, None, None])
    )


def spoke_pixels(image: NDArray[np.uint8], conics: Conics) -> EdgePixels:
    """Select three pixels to each side of the outlines on 16 spokes, as many for every disc."""
    inside = np.minimum(1.0, INSIDE / 3.0 * conics.ellipses.half_axes[1])[:, None]
    steps = np.where(_SPOKE < 0.0, _SPOKE * inside, _SPOKE)[:, None, :, None]
    at = np.rint(conics.rim[:, :, None] + steps * conics.outward[:, :, None])
    u, v = at.reshape(len(at), 2, -1).astype(np.float32).swapaxes(0, 1)
    left, top = -conics.origin.T[..., None]
    height, width = image.shape
    seen = (u >= left) & (u < left + width) & (v >= top) & (v < top + height)
    return _looked_up(image, conics.origin, u, v, seen.astype(np.float32))


def band_pixels(image: NDArray[np.uint8], conics: Conics, band: float) -> EdgePixels:
    """Select all pixels within a band, so many pixels to each side of the outlines."""
    u, v, weight = ring_pixels(conics.ellipses, conics.origin, image.shape, band + _SLACK)
    return _looked_up(image, conics.origin, u, v, weight)


def area_pixels(image: NDArray[np.uint8], conics: Conics, band: float) -> EdgePixels:
    """Select all pixels inside of the outlines or not farther outside than a band."""
    size = image.shape
    u, v, weight = ring_pixels(conics.ellipses, conics.origin, size, band + _SLACK, hollow=False)
    return _looked_up(image, conics.origin, u, v, weight)


def _looked_up(
    image: NDArray[np.uint8],
    origin: FloatArray,
    u: SingleArray,
    v: SingleArray,
    weight: SingleArray,
) -> EdgePixels:
    width = image.shape[1]
    # in place, as time goes into memory
    offset = v * np.float32(width)
    offset += u
    index = offset.astype(np.int64)
    index += (origin[:, :1] + width * origin[:, 1:]).astype(np.int64)
    terms = np.empty((6, *u.shape), dtype=np.float32)
    terms[0], terms[1], terms[2] = 1.0, u, v
    np.multiply(terms[1:3], u, out=terms[3:5])
    np.multiply(v, v, out=terms[5])
    levels = image.take(index, mode="clip")
    return EdgePixels(levels.astype(np.float32), weight, terms, at_limits(levels))
