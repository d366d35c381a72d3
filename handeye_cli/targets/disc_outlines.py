"""Outlines of discs that are about known: where their edges are, and whether they are discs at all.

Rays leave each middle in all directions. Along a ray the edge is where the grey level is half way
between the ink inside and the paper outside, of that ray alone, so that light may change across a
disc. The first harmonics of the edge's distance correct the middle, the others the shape.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.two_by_two import determinants, mapped_back
from handeye_cli.records import FloatArray, GreyImage
from handeye_cli.targets.disc_spots import BoolArray

_RAYS = 16
_SAMPLES = 10
_INK = 0.5
"""Where the ink is sampled, in radii."""
_PAPER = (1.15, 1.5)
"""Where the paper is sampled, in radii: half way to the next disc, but within these limits."""
_NARROWEST = 0.15
"""Half of the band around an expected edge, at least, in radii."""
_FAINTEST = 8.0
"""Grey levels between ink and paper along a ray that count as an edge."""
_EDGED = 0.8
"""Share of the rays that need an edge for the outline to be trusted."""
_PARTLY = 0.5
"""Share that shows a disc all the same: across the rest the edge of a shadow may run."""
_EVEN = 0.4
"""Least contrast along a ray over the largest of the same disc, unless a shadow ends on it."""
_RAGGED = 0.15
"""Largest RMS distance of the edge to an ellipse, in radii."""
_MOVED = 0.6
"""Largest correction of a middle, in radii."""
_GROWN = 1.6
"""Largest correction of a size, as a factor."""
_MARGIN = 1.0
"""Pixels between a whole disc and the middles of the image's outermost pixels."""

_AT_ONCE = 2000
"""Discs sampled at once: OpenCV's images of rays are at most 32766 pixels wide."""

_STEPS = np.linspace(0.0, 1.0, _SAMPLES)
_SHARES = np.array([0.5, *np.ones(_SAMPLES - 2), 0.5], dtype=np.float32) / (_SAMPLES - 1)
"""Of the samples in their mean; the outer ones stand for half a step."""
_ANGLES = 2.0 * np.pi * np.arange(_RAYS) / _RAYS
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)])
_HARMONICS = np.stack([np.ones(_RAYS), *_CIRCLE, np.cos(2 * _ANGLES), np.sin(2 * _ANGLES)])
"""(5, rays) waves round a circle: of its size, its middle and its stretch."""
_FOURTH = np.stack([np.cos(4 * _ANGLES), np.sin(4 * _ANGLES)])
"""(2, rays) waves that four corners make."""
_WAVES = np.concatenate([_HARMONICS, _FOURTH])
_WEIGHTS = (_WAVES / np.sum(_WAVES**2, axis=1, keepdims=True)).T
"""(rays, 7) weights of a distance along each ray in the heights of the waves."""
_EQUAL = np.full(_RAYS, 1.0 / _RAYS)

SingleArray = NDArray[np.float32]


class Outlines(NamedTuple):
    """Discs as ellipses in an image.

    Attributes:
        centres: (n, 2) middles, pixels.
        shapes: (n, 2, 2) matrices that map the unit circle to an ellipse around its middle.
        seen: (n,) whether there is a dark disc, or the part of one that is in the image.
        sure: (n,) whether its outline was measured; otherwise it stays as it was expected.
        ragged: (n,) RMS distance of the edge to the ellipse, in radii.
        corners: (n, 2) fourth harmonic of this distance: with four corners alike it is alike.
        even: (n,) whether ink and paper are about as far apart all around.
        whole: (n,) whether all of the disc is in the image.
    """

    centres: FloatArray
    shapes: FloatArray
    seen: BoolArray
    sure: BoolArray
    ragged: FloatArray
    corners: FloatArray
    even: BoolArray
    whole: BoolArray


def measure(
    image: GreyImage,
    centres: FloatArray,
    shapes: FloatArray,
    reach: float,
    *,
    known: BoolArray,
    doubt: float,
) -> Outlines:
    """Measure dark discs in an image.

    Args:
        image: (height, width) image.
        centres: (n, 2) middles, pixels, good to a quarter of a radius.
        shapes: (n, 2, 2) maps from the unit circle to the ellipses.
        reach: Distance of neighbours in radii: half way to them the paper is sampled.
        known: (n,) discs whose edges are known up to a doubt.
        doubt: Pixels.
    """
    paper = min(max(0.5 * reach, _PAPER[0]), _PAPER[1])
    within = inside(centres, shapes, image.shape)
    start = rough = Outlines(
        centres,
        shapes,
        within,
        within,
        np.zeros(len(centres)),
        np.zeros_like(centres),
        within,
        within,
    )
    if not known.all():
        rough = _corrected(image, start, np.full(len(centres), 1.0 - _INK), paper)
    radius = np.sqrt(np.abs(determinants(rough.shapes)))
    band = np.minimum(np.maximum(doubt / radius, _NARROWEST), 1.0 - _INK)
    fine = _corrected(image, rough, band, paper)
    moved = mapped_back(shapes, fine.centres - centres)
    grown = np.abs(determinants(fine.shapes) / determinants(shapes))
    near = np.hypot(moved[:, 0], moved[:, 1]) < _MOVED
    near &= (grown < _GROWN**2) & (grown > _GROWN**-2)
    sure = fine.sure & near
    whole = np.where(sure, within & inside(fine.centres, fine.shapes, image.shape), within)
    sure &= whole
    seen = fine.seen
    if not whole.all():
        seen = np.where(whole, seen, _part_seen(image, start, paper))
    return Outlines(
        np.where(sure[:, None], fine.centres, centres),
        np.where(sure[:, None, None], fine.shapes, shapes),
        np.asarray(seen),
        sure,
        fine.ragged,
        fine.corners,
        fine.even,
        np.asarray(whole),
    )


def inside(centres: FloatArray, shapes: FloatArray, size: tuple[int, ...]) -> BoolArray:
    """Say which ellipses an image of a height and width shows whole.

    Args:
        centres: (n, 2) middles, pixels.
        shapes: (n, 2, 2) maps from the unit circle to the ellipses.
        size: Height and width.
    """
    extent = np.hypot(shapes[..., 0], shapes[..., 1])
    last = np.array(size[::-1]) - 1
    within = (centres - extent > _MARGIN) & (centres + extent < last - _MARGIN)
    return np.asarray(within[:, 0] & within[:, 1])


def _points(outlines: Outlines, radii: FloatArray) -> SingleArray:
    """Return x and y, (2, m, n, rays) pixels, at (m, n) radii along the rays of each disc."""
    ends = (outlines.shapes @ _CIRCLE).transpose(1, 0, 2).astype(np.float32)
    middles = outlines.centres.T.astype(np.float32)
    points = ends[:, None] * radii.astype(np.float32)[..., None]
    points += middles[:, None, :, None]
    return np.asarray(points)


def _sampled(image: GreyImage, points: SingleArray) -> SingleArray:
    """Return the (m, n, rays) grey levels at (2, m, n, rays) points, beyond the edge as there."""
    parts = [points[:, :, k : k + _AT_ONCE] for k in range(0, points.shape[2], _AT_ONCE)]
    if len(parts) > 1:
        return np.concatenate([_sampled(image, part) for part in parts], axis=1)
    x, y = points.reshape(2, points.shape[1], -1)
    levels = cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(levels.reshape(points.shape[1:]), dtype=np.float32)


def _corrected(image: GreyImage, outlines: Outlines, band: FloatArray, paper: float) -> Outlines:
    """Return the ellipses through the edges found within a band, in radii, around the present."""
    first, last = 1.0 - band, np.minimum(1.0 + band, paper)
    radii = np.empty((_SAMPLES + 2, len(band)))
    radii[0], radii[-1] = _INK, paper
    radii[1:-1] = first + (last - first) * _STEPS[:, None]
    levels = _sampled(image, _points(outlines, radii))
    light = levels[-1]
    contrast = light - levels[0]
    darkness = light - levels[1:-1]
    darkness /= np.maximum(contrast, 1.0)
    np.maximum(darkness, 0.0, out=darkness)
    np.minimum(darkness, 1.0, out=darkness)
    # of an edge from 1 to 0, the mean says where it is
    share = (_SHARES @ darkness.reshape(_SAMPLES, -1)).reshape(light.shape)
    edge = first[:, None] + (last - first)[:, None] * share
    even = contrast.min(axis=1) > _EVEN * contrast.max(axis=1)
    fitted = _fitted(outlines, edge, (contrast > _FAINTEST) @ _EQUAL)
    return fitted._replace(even=np.asarray(even))


def _fitted(outlines: Outlines, edge: FloatArray, edged: FloatArray) -> Outlines:
    """Return the ellipses through (n, rays) edges, which are distances in radii.

    `edged` is the (n,) share of the rays that have an edge.
    """
    terms = edge @ _WEIGHTS
    misses = edge - terms[:, :5] @ _HARMONICS
    ragged = np.sqrt((misses * misses) @ _EQUAL)
    # how the unit circle is stretched, and where its middle goes
    changed = np.empty((len(terms), 2, 3))
    changed[:, 0, 1] = changed[:, 1, 0] = terms[:, 4]
    changed[:, 0, 0] = terms[:, 0] + terms[:, 3]
    changed[:, 1, 1] = terms[:, 0] - terms[:, 3]
    changed[:, :, 2] = terms[:, 1:3]
    changed = outlines.shapes @ changed
    return outlines._replace(
        centres=outlines.centres + changed[:, :, 2],
        shapes=changed[:, :, :2],
        seen=np.asarray(edged >= _PARTLY),
        sure=np.asarray((edged >= _EDGED) & (ragged < _RAGGED)),
        ragged=np.asarray(ragged),
        corners=terms[:, 5:],
    )


def _part_seen(image: GreyImage, outlines: Outlines, paper: float) -> BoolArray:
    """Say which discs show ink within and paper around, as far as they are in the image."""
    radii = np.array([0.25, 0.5, 0.75, paper])[:, None] * np.ones(len(outlines.centres))
    points = _points(outlines, radii)
    last = np.array(image.shape[::-1]).reshape(2, 1, 1, 1) - 1
    visible = np.all((points >= 0.0) & (points <= last), axis=0)
    levels = _sampled(image, points) * visible
    counts = np.stack([visible[:3].sum((0, 2)), visible[3].sum(1)])
    ink = np.sum(levels[:3], axis=(0, 2)) / np.maximum(counts[0], 1)
    light = np.sum(levels[3], axis=1) / np.maximum(counts[1], 1)
    return np.asarray((counts.min(axis=0) >= 3) & (light - ink > 2 * _FAINTEST))
