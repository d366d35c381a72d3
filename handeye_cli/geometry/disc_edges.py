"""How far pixels are from the edge of a disc, and how much of a pixel a blurred disc covers.

On the plate a disc is a circle. What is measured is in pixels of the image, across the edge, to
second order: neither the perspective within a disc nor the curvature of its outline is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handeye_cli.geometry.disc_pixels import EdgePixels, FloatArray, Patches, SingleArray

_NOWHERE = 6.0
_FAR = 3.2
"""Blurs beyond which the edge of another disc is not noticed."""


@dataclass(frozen=True)
class Edges:
    """Pixels with their distances from the edge, linearised in shift and growth.

    Attributes:
        pixels: The pixels.
        weight: (n, m) 1 for a pixel that takes part, else 0.
        distance: (n, m) from the edge, pixels, positive inside.
        by_shift: (n, 3, m) derivative of the distance by shift and growth, in radii.
        others: (n, m) distance from the edge of the nearest other disc, or None where all are far.
    """

    pixels: EdgePixels
    weight: SingleArray
    distance: SingleArray
    by_shift: SingleArray
    others: SingleArray | None


def measure(
    patches: Patches, pixels: EdgePixels, moved: FloatArray, *, blur: float, band: float
) -> Edges:
    """Measure pixels against the edges of discs.

    Args:
        patches: The surroundings of the n discs.
        pixels: The pixels.
        moved: (n, 3) shift and growth of the discs against their nominal place, in radii.
        blur: Standard deviation of the edges, pixels.
        band: Pixels farther from the edge take no part.
    """
    away = pixels.plate - moved[:, :2, None].astype(np.float32)
    radius = (1.0 + moved[:, 2:]).astype(np.float32)
    distance, outward, scale = _distance(patches, pixels.slopes, away, radius, blur)
    weight = pixels.weight * (np.abs(distance) < band)
    others = None
    if patches.gap < band + _FAR * blur:
        relative, beyond = _nearest_other(patches, away, radius)
        others, _, _ = _distance(patches, pixels.slopes, relative, beyond, blur)
        # far away it makes no difference, but numbers near nothing are slow
        np.maximum(others, np.float32(-_NOWHERE * blur), out=others)
    return Edges(
        pixels=pixels,
        weight=weight,
        distance=distance,
        by_shift=np.concatenate([outward * scale[:, None], scale[:, None]], axis=1),
        others=others,
    )


def _distance(
    patches: Patches, slopes: SingleArray, away: SingleArray, radius: SingleArray, blur: float
) -> tuple[SingleArray, SingleArray, SingleArray]:
    """Return how far pixels are from the circles around, positive inside.

    Args:
        patches: The surroundings of the n discs.
        slopes: (n, 4, m) derivatives of the plate's x, y by the pixel's u, then by its v.
        away: (n, 2, m) from the circles' centres to the pixels, on the plate.
        radius: (n, 1) or (n, m) radii, on the plate.
        blur: Standard deviation of the edges, pixels.

    Returns:
        (n, m) pixels, (n, 2, m) directions on the plate from the centres, (n, m) pixels across the
        edge for a step of 1 on the plate.
    """
    x, y = away[:, 0], away[:, 1]
    length: SingleArray = np.maximum(np.sqrt(x * x + y * y), np.float32(1e-6))
    outward = away / length[:, None]
    cosine, sine = outward[:, 0], outward[:, 1]
    x_u, y_u, x_v, y_v = np.moveaxis(slopes, 1, 0)
    across_u, across_v = cosine * x_u + sine * y_u, cosine * x_v + sine * y_v
    scale = 1.0 / np.sqrt(across_u * across_u + across_v * across_v)
    u, v = across_u * scale, across_v * scale
    # a step of a pixel along (u, v) leads aside on the plate by so much
    aside = cosine * (y_u * u + y_v * v) - sine * (x_u * u + x_v * v)
    bend = patches.bends @ np.stack([u * u, u * v, v * v], axis=1)
    second = cosine * bend[:, 0] + sine * bend[:, 1] + aside * aside / length
    area = (x_u * y_v - x_v * y_u) * scale
    first = (radius - length) * scale
    # a blurred round edge is half covered a little inside of itself
    inside = np.float32(0.5 * blur * blur) * area * area * scale / length
    return first - 0.5 * scale * second * first * first - inside, outward, scale


def _nearest_other(
    patches: Patches, away: SingleArray, radius: SingleArray
) -> tuple[SingleArray, SingleArray]:
    """Return the (n, 2, m) place relative to the nearest of the other discs, and its radius.

    `away` is relative to the disc's centre as it was found; the others lie where the plate says,
    and have grown as this one.
    """
    nearest = np.full((len(away), away.shape[2]), -np.inf, dtype=np.float32)
    relative, size = np.empty_like(away), np.empty_like(nearest)
    for other in np.moveaxis(patches.others, 1, 0)[..., None]:
        here = away - other[:, :2]
        inside = radius * other[:, 2] - np.sqrt(here[:, 0] ** 2 + here[:, 1] ** 2)
        nearer = inside > nearest
        nearest = np.where(nearer, inside, nearest)
        relative = np.where(nearer[:, None], here, relative)
        size = np.where(nearer, radius * other[:, 2], size)
    return relative, size
