"""Outlines of discs that are about known: where their edges are, and whether they are discs at all.

Rays leave each middle in all directions. Along a ray the edge is where the grey level is half way
between the ink inside and the paper outside, of that ray alone, so that light may change across a
disc. The first harmonics of the edge's distance correct the middle, the others the shape.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from handeye_cli.records import FloatArray, GreyImage
from handeye_cli.targets.disc_spots import BoolArray, determinants

_RAYS = 24
_SAMPLES = 10
_INK = 0.5
"""Where the ink is sampled, in radii."""
_PAPER = (1.15, 1.5)
"""Where the paper is sampled, in radii: half way to the next disc, but within these limits."""
_BAND = (0.1, 2.5)
"""Half of the band around an edge that is measured last, at least: radii and pixels."""
_FAINTEST = 8.0
"""Grey levels between ink and paper along a ray that count as an edge."""
_EDGED = 0.8
"""Share of the rays that need an edge."""
_RAGGED = 0.15
"""Largest RMS distance of the edge to an ellipse, in radii."""
_MOVED = 0.6
"""Largest correction of a middle, in radii."""
_MARGIN = 1.0
"""Pixels between a whole disc and the middles of the image's outermost pixels."""


@dataclass(frozen=True)
class Outlines:
    """Discs as ellipses in an image.

    Attributes:
        centres: (n, 2) middles, pixels.
        shapes: (n, 2, 2) matrices that map the unit circle to an ellipse around its middle.
        seen: (n,) whether there is a dark disc, or the part of one that is in the image.
        whole: (n,) whether all of the disc is in the image.
    """

    centres: FloatArray
    shapes: FloatArray
    seen: BoolArray
    whole: BoolArray


def measure(image: GreyImage, centres: FloatArray, shapes: FloatArray, reach: float) -> Outlines:
    """Measure dark discs in an image.

    Args:
        image: (height, width) image.
        centres: (n, 2) middles, pixels, good to a quarter of a radius.
        shapes: (n, 2, 2) maps from the unit circle to the ellipses.
        reach: Distance of neighbours in radii: half way to them the paper is sampled.
    """
    paper = float(np.clip(0.5 * reach, *_PAPER))
    within = inside(centres, shapes, image.shape)
    start = Outlines(centres, shapes, np.ones_like(within), within)
    rough = _corrected(image, start, np.full(len(centres), 1.0 - _INK), paper)
    radius = np.sqrt(np.abs(determinants(rough.shapes)))
    band = np.clip(_BAND[1] / radius, _BAND[0], 1.0 - _INK)
    fine = _corrected(image, rough, band, paper)
    moved = np.linalg.solve(shapes, (fine.centres - centres)[..., None])[..., 0]
    size = np.sqrt(np.abs(determinants(fine.shapes) / determinants(shapes)))
    near = (np.linalg.norm(moved, axis=1) < _MOVED) & (np.abs(np.log(size)) < np.log(1.6))
    whole = start.whole & inside(fine.centres, fine.shapes, image.shape)
    seen = fine.seen & near
    if not np.all(whole):
        seen = np.where(whole, seen, _part_seen(image, start, paper))
    # what is cut by the image's edge stays where it was expected
    return Outlines(
        np.where(whole[:, None], fine.centres, centres),
        np.where(whole[:, None, None], fine.shapes, shapes),
        np.asarray(seen),
        whole,
    )


def inside(centres: FloatArray, shapes: FloatArray, size: tuple[int, ...]) -> BoolArray:
    """Say which ellipses an image of a height and width shows whole.

    Args:
        centres: (n, 2) middles, pixels.
        shapes: (n, 2, 2) maps from the unit circle to the ellipses.
        size: Height and width.
    """
    extent = np.linalg.norm(shapes, axis=2)
    last = np.array(size[::-1]) - 1
    within = (centres - extent > _MARGIN) & (centres + extent < last - _MARGIN)
    return np.asarray(np.all(within, axis=1))


def _circle() -> FloatArray:
    angles = 2.0 * np.pi * np.arange(_RAYS) / _RAYS
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def _sampled(image: GreyImage, outlines: Outlines, radii: FloatArray) -> tuple[FloatArray, ...]:
    """Return (n, rays, m) grey levels at (n, m) radii of each disc, and the points' pixels."""
    ends = np.einsum("nab,kb->nka", outlines.shapes, _circle())
    points = outlines.centres[:, None, None] + radii[:, None, :, None] * ends[:, :, None]
    flat = points.reshape(len(points), -1, 2).astype(np.float32)
    levels = cv2.remap(
        image, flat[..., 0], flat[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return levels.reshape(points.shape[:3]).astype(np.float64), points


def _corrected(image: GreyImage, outlines: Outlines, band: FloatArray, paper: float) -> Outlines:
    """Return the ellipses through the edges found within a band, in radii, around the present."""
    first, last = 1.0 - band, np.minimum(1.0 + band, paper)
    radii = first[:, None] + (last - first)[:, None] * np.linspace(0.0, 1.0, _SAMPLES)
    ends = np.ones((len(radii), 1))
    radii = np.hstack([_INK * ends, radii, paper * ends])
    levels, _ = _sampled(image, outlines, radii)
    ink, light = levels[..., :1], levels[..., -1:]
    contrast = light - ink
    darkness = np.clip((light - levels[..., 1:-1]) / np.maximum(contrast, 1.0), 0.0, 1.0)
    # of an edge from 1 to 0, the mean says where it is; the outer samples stand for half a step
    share = (darkness.sum(-1) - 0.5 * (darkness[..., 0] + darkness[..., -1])) / (_SAMPLES - 1)
    edge = first[:, None] + (last - first)[:, None] * share
    edged = np.mean(contrast[..., 0] > _FAINTEST, axis=1) >= _EDGED
    return _fitted(outlines, edge, np.asarray(edged))


def _fitted(outlines: Outlines, edge: FloatArray, edged: BoolArray) -> Outlines:
    """Return the ellipses through (n, rays) edges, which are distances in radii."""
    x, y = _circle().T
    harmonics = np.stack([np.ones(_RAYS), x, y, x * x - y * y, 2 * x * y])
    weights = harmonics / np.sum(harmonics**2, axis=1, keepdims=True)
    terms = edge @ weights.T
    ragged = np.sqrt(np.mean((edge - terms @ harmonics) ** 2, axis=1))
    size, along, across = terms[:, 0], terms[:, 3], terms[:, 4]
    stretch = np.stack([size + along, across, across, size - along], axis=-1).reshape(-1, 2, 2)
    centres = outlines.centres + np.einsum("nab,nb->na", outlines.shapes, terms[:, 1:3])
    return replace(
        outlines,
        centres=centres,
        shapes=outlines.shapes @ stretch,
        seen=edged & (ragged < _RAGGED),
    )


def _part_seen(image: GreyImage, outlines: Outlines, paper: float) -> BoolArray:
    """Say which discs show ink within and paper around, as far as they are in the image."""
    radii = np.broadcast_to([0.25, 0.5, 0.75, paper], (len(outlines.centres), 4))
    levels, points = _sampled(image, outlines, radii)
    last = np.array(image.shape[::-1]) - 1
    visible = np.all((points >= 0.0) & (points <= last), axis=-1)
    counts = np.stack([visible[..., :3].sum((1, 2)), visible[..., 3].sum(1)])
    ink = np.sum(levels[..., :3] * visible[..., :3], axis=(1, 2)) / np.maximum(counts[0], 1)
    light = np.sum(levels[..., 3] * visible[..., 3], axis=1) / np.maximum(counts[1], 1)
    return np.asarray((counts.min(axis=0) >= 3) & (light - ink > 2 * _FAINTEST))
