"""Grids of discs in an image: found as spots on a lattice, then measured one by one.

What is measured is the middle of the ellipse that a tilted disc becomes. The image of the disc's
own centre lies up to 0.1 px or so beside it; only the camera and the pose tell where.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import cv2
import numpy as np

from handeye_cli.records import FloatArray, GreyImage, IntArray
from handeye_cli.targets import disc_outlines, disc_reasons
from handeye_cli.targets.board import Detection
from handeye_cli.targets.disc_lattice import Cells, grow
from handeye_cli.targets.disc_spots import BoolArray, Spots, determinants, find_spots
from handeye_cli.targets.disc_window import windows

_SIDE = 800
"""Pixels of the longer side of the image the discs are sought in first, at most."""
_SMALL = (23, 0.4)
_LADDER = ((45, 0.2), _SMALL, (161, 0.0))
"""Ways to tell dark from light: window, pixels, and depth. Larger images only serve small discs."""
_ABSENT = 0.4
"""Share of the discs that may be missing among the spots; they are sought at their places."""
_MOST_WINDOWS = 4
_MISFIT = 0.35
"""A grid is refused when a disc is off by more pitches; lens distortion bends it less."""
_ODD = 0.17
"""Pitches by which a disc may be off its place more than its neighbours are."""
_ODD_SPOT = 0.2
"""The same for a spot, which is not measured yet."""
_WIDE = 1.3
"""A spot of so many times the expected area may be the larger corner disc."""


@dataclass(frozen=True)
class Pattern:
    """A layout of discs on a square lattice.

    Attributes:
        lattice: (n, 2) points in half pitches of the board.
        places: (n, 2) the same as whole steps between nearest neighbours, axes turning alike.
        reach: Distance of nearest neighbours in radii of a disc.
        larger: Radius of the larger corner disc in radii of the others, 1 without.
        name: For messages, such as `6x6`.
    """

    lattice: IntArray
    places: IntArray
    reach: float
    larger: float
    name: str


@dataclass(frozen=True)
class Discs:
    """A grid of discs in an image.

    Attributes:
        pixels: (n, 2) centres, in the order of the lattice up to a turn.
        sizes: (n,) diameters in distances of nearest neighbours.
        whole: (n,) whether the image's edge leaves the disc uncut.
    """

    pixels: FloatArray
    sizes: FloatArray
    whole: BoolArray

    def detection(self, order: IntArray) -> Detection:
        """Return the whole discs, where `order[k]` is the disc that is point k.

        A cut disc has no centre to be measured; it only counts for the order of the others.
        """
        ids = np.flatnonzero(self.whole[order]).astype(np.int64)
        return Detection(ids, self.pixels[order[ids]])


def find_discs(grey: GreyImage, pattern: Pattern) -> Discs | str:
    """Return a grid of discs, dark or light, or the reason why there is none.

    Args:
        grey: (height, width) image.
        pattern: What is sought.
    """
    attempts = disc_reasons.Attempts(len(pattern.lattice), pattern.name)
    for image, factor, ladder in _reduced(grey):
        for (window, depth), light in product(ladder, (False, True)):
            spots = find_spots(255 - image if light else image, window, depth).scaled(factor)
            attempts.saw(spots.widths)
            for part in grow(spots, pattern.reach, pattern.larger):
                found = _arranged(255 - grey if light else grey, pattern, spots, part, attempts)
                if found is not None:
                    return found
    return attempts.reason(grey)


def _reduced(grey: GreyImage) -> Iterator[tuple[GreyImage, int, tuple[tuple[int, float], ...]]]:
    """Yield ever larger versions of an image up to itself, each with its factor and ladder."""
    factor = -(-max(grey.shape) // _SIDE)
    for each in sorted({factor, -(-factor // 2), 1}, reverse=True):
        rows, columns = (size // each for size in grey.shape)
        if min(rows, columns) > 0:
            part = grey[: rows * each, : columns * each]
            small = cv2.resize(part, (columns, rows), interpolation=cv2.INTER_AREA)
            yield np.asarray(small, dtype=np.uint8), each, _LADDER if each == factor else (_SMALL,)


def _arranged(
    image: GreyImage,
    pattern: Pattern,
    spots: Spots,
    part: Cells,
    attempts: disc_reasons.Attempts,
) -> Discs | None:
    """Return the dark discs of a part of a lattice, measured, if they are the declared ones."""
    candidates, covered = windows(pattern.places, part.places)
    boxes = [_boxes(places, part.homography, pattern.reach) for places in candidates]
    attempts.fitted(covered, boxes, image.shape)
    if covered == len(pattern.places) and len(candidates) > 1:
        return None
    found = []
    for places in candidates[:_MOST_WINDOWS]:
        centres, shapes, known = _expected(places, pattern, spots, part)
        if not _complete(centres, shapes, known, image.shape):
            continue
        discs = _measured(image, pattern, centres, shapes)
        if discs is not None:
            found.append(discs)
    return found[0] if len(found) == 1 else None


def _expected(
    places: IntArray, pattern: Pattern, spots: Spots, part: Cells
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return centres and shapes of the discs at (n, 2) places, and which are spots already."""
    spot_at = dict(zip(map(tuple, part.places.tolist()), part.members.tolist(), strict=True))
    members = np.array([spot_at.get((x, y), -1) for x, y in places.tolist()])
    known = members >= 0
    centres, jacobian = _projected(part.homography, places)
    off = np.where(known[:, None], spots.centres[members] - centres, 0.0)
    likely = _smooth(places, off, known)
    known &= _pitches(jacobian, off - likely) < _ODD_SPOT
    likely = _smooth(places, off, known)
    shapes = jacobian / pattern.reach
    wide = known & (determinants(spots.shapes[members]) > _WIDE * np.abs(determinants(shapes)))
    if pattern.larger > 1.0:
        shapes[wide] = spots.shapes[members[wide]]
    return centres + np.where(known[:, None], off, likely), shapes, known


def _boxes(places: IntArray, homography: FloatArray, reach: float) -> FloatArray:
    """Return the (n, 2, 2) least and largest x and y of discs at places."""
    centres, jacobian = _projected(homography, places)
    extent = np.linalg.norm(jacobian, axis=2) / reach
    return np.stack([centres - extent, centres + extent], axis=1)


def _smooth(places: IntArray, off: FloatArray, known: BoolArray) -> FloatArray:
    """Return what (n, 2) offsets should be, going by the other known ones around.

    The lens bends a grid smoothly: a disc is off its place as its neighbours are.
    """
    apart = np.sum((places[:, None] - places) ** 2, axis=-1).astype(np.float64)
    np.fill_diagonal(apart, np.inf)
    weights = known / apart**2
    return np.asarray(weights @ off / np.maximum(weights.sum(axis=1, keepdims=True), 1e-12))


def _pitches(jacobian: FloatArray, off: FloatArray) -> FloatArray:
    """Return the (n,) lengths of offsets in pixels as pitches of the lattice there."""
    return np.asarray(np.linalg.norm(np.linalg.solve(jacobian, off[..., None]), axis=(1, 2)))


def _projected(homography: FloatArray, places: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the (n, 2) pixels of places and the (n, 2, 2) derivatives by the places."""
    seen = places @ homography[:, :2].T + homography[:, 2]
    pixels = seen[:, :2] / seen[:, 2:]
    slope = homography[:2, :2] - pixels[:, :, None] * homography[2, :2]
    return pixels, slope / seen[:, 2, None, None]


def _complete(
    centres: FloatArray, shapes: FloatArray, known: BoolArray, size: tuple[int, ...]
) -> bool:
    """Say whether so many discs are spots that the others may be sought at their places."""
    absent = disc_outlines.inside(centres, shapes, size) & ~known
    return bool(absent.sum() <= max(1, _ABSENT * len(known)) and np.sum(known) >= 4)


def _measured(
    image: GreyImage, pattern: Pattern, centres: FloatArray, shapes: FloatArray
) -> Discs | None:
    """Return the discs near (n, 2) centres, or None when they are not a plane grid of discs."""
    outlines = disc_outlines.measure(image, centres, shapes, pattern.reach)
    whole = outlines.whole
    if not np.all(outlines.seen) or np.sum(whole) < 4:
        return None
    places = pattern.places.astype(np.float64)
    homography, _ = cv2.findHomography(places[whole], outlines.centres[whole])
    if np.shape(homography) != (3, 3):
        return None
    expected, jacobian = _projected(np.asarray(homography, dtype=np.float64), pattern.places)
    off = outlines.centres - expected
    odd = _pitches(jacobian, off - _smooth(pattern.places, off, whole))
    if np.any(odd[whole] > _ODD) or np.any(_pitches(jacobian, off)[whole] > _MISFIT):
        return None
    areas = np.abs(determinants(outlines.shapes) / determinants(jacobian))
    return Discs(outlines.centres, 2.0 * np.sqrt(areas), whole)
