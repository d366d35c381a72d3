"""Outlines of discs in an image, and where an outline puts the disc's centre.

What an image shows of a disc is its outline. Which point within is the image of the disc's centre
depends on the map from the plate to the image, by perspective and by lens distortion.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.camera import PlateToPixel

FloatArray = NDArray[np.float64]

_RING = 16
"""Points on an outline."""


def outlines(
    discs: FloatArray, to_pixel: PlateToPixel, moved: FloatArray | None = None
) -> FloatArray:
    """Return the (n, 16, 2) outlines of discs in the image.

    Args:
        discs: (n, 3) centre (x, y) on the plate and radius, metres.
        to_pixel: Map of (..., 2) plate points to (..., 2) pixels.
        moved: (n, 3) by how much the discs are shifted and grown, in radii, or None.
    """
    angle = 2.0 * np.pi * np.arange(_RING) / _RING
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    if moved is not None:
        ring = moved[:, None, :2] + (1.0 + moved[:, None, 2:]) * ring
    return to_pixel(discs[:, None, :2] + discs[:, 2, None, None] * ring)


def centres_of(seen: FloatArray, discs: FloatArray, to_pixel: PlateToPixel) -> FloatArray:
    """Return the (n, 2) images of the centres of discs whose outlines are seen.

    The mapped outline of each disc is shifted and grown until it fits the seen one, all along it.

    Args:
        seen: (n, 16, 2) seen outlines, pixels, of the same points of the discs as `outlines` has.
        discs: (n, 3) centre (x, y) on the plate and radius, metres.
        to_pixel: Map of (..., 2) plate points to (..., 2) pixels; it need not put the discs
            where they are seen.
    """
    centre = to_pixel(discs[:, :2])
    mapped = outlines(discs, to_pixel) - centre[:, None]
    along = np.roll(mapped, -1, axis=1) - np.roll(mapped, 1, axis=1)
    length = np.sqrt(np.sum(along**2, axis=-1, keepdims=True))
    normal = np.stack([along[..., 1], -along[..., 0]], axis=-1) / length
    rows = np.concatenate([normal, np.sum(normal * mapped, axis=-1, keepdims=True)], axis=-1)
    apart = np.sum(normal * (seen - mapped), axis=-1, keepdims=True)
    weighted = np.swapaxes(rows * length, -1, -2)
    return np.asarray(np.linalg.solve(weighted @ rows, weighted @ apart)[:, :2, 0])
