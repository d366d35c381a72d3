"""Grids of discs in an image: found as spots on a lattice, then measured one by one.

What is measured is the middle of the ellipse that a tilted disc becomes. The image of the disc's
own centre lies up to 0.1 px or so beside it; only the camera and the pose tell where.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.spatial.distance import cdist

from handeye_cli.geometry.light_slopes import typical
from handeye_cli.geometry.two_by_two import determinants, mapped_back
from handeye_cli.records import FloatArray, GreyImage, IntArray
from handeye_cli.targets import disc_outlines, disc_reasons
from handeye_cli.targets.board import Detection
from handeye_cli.targets.disc_ladder import Step, ladder, spots_of
from handeye_cli.targets.disc_lattice import Cells, grow
from handeye_cli.targets.disc_outlines import Outlines
from handeye_cli.targets.disc_spots import BoolArray, Spots
from handeye_cli.targets.disc_strangers import Strangers, strangers
from handeye_cli.targets.layout_places import best_places

_DOUBT = 1.25
"""Pixels by which the edge of a spot may be off, of the image and of that it was found in each."""
_ABSENT = 0.4
"""Share of the discs that may be missing among the spots; they are sought at their places."""
_MOST_WINDOWS = 4
_MISFIT = 0.35
"""A grid is refused when a disc is off by more pitches; lens distortion bends it less."""
_ODD = 0.17
"""Pitches by which a disc may be off its place more than its neighbours are."""
_ODD_SPOT = 0.2
"""The same for a spot, which is not measured yet."""
_LOOSE = 0.05
"""The same in the median: up to 0.03 on small plates in noise, from 0.06 where chance set spots."""
_MOVED = 0.06
"""The same beyond which a disc on the edge of a shadow is taken to be where its neighbours say."""
_SURE = 0.7
"""Share of the discs whose outlines must be sure."""
_ANGULAR = 0.048
"""Median RMS distance of the edges to ellipses, in radii, beyond which they are squares: 0.057."""
_CORNERS, _CORNERS_PX = 0.02, 0.1
"""Fourth harmonic that discs have in common, in radii and pixels, at most: squares have 0.035."""
_BY_CHANCE = 16
"""Discs of a grid below which some among hundreds of spots in clutter may lie on one by chance."""
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

    @cached_property
    def closeness(self) -> FloatArray:
        """(n, n) one over the fourth power of the distances of places, 0 of a place to itself."""
        places = self.places.astype(np.float64)
        square = np.asarray(cdist(places, places, "sqeuclidean"))
        np.fill_diagonal(square, np.inf)
        # in place: of thousands of discs one such table is large enough
        square *= square
        np.reciprocal(square, out=square)
        return square


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


class _Expected(NamedTuple):
    """Where the discs of a grid should be.

    Attributes:
        places: (n, 2) on the lattice of spots.
        centres: (n, 2) pixels, those of spots where there are some.
        shapes: (n, 2, 2) maps from the unit circle to the discs.
        known: (n,) whether there is a spot.
        seats: (n, 2) places in the plane of the spots, lens distortion aside, pixels.
        jacobian: (n, 2, 2) derivatives of the seats by the places.
    """

    places: IntArray
    centres: FloatArray
    shapes: FloatArray
    known: BoolArray
    seats: FloatArray
    jacobian: FloatArray


class _Miss(NamedTuple):
    """How a lattice of spots misses the declared grid.

    Attributes:
        covered: Most spots that lie at places of the grid.
        boxes: (n, 2, 2) least and largest x and y of the grid's discs, pixels, for each way in
            which it covers so many.
        strange: Discs that have no place in the grid, where it was found among more of them.
    """

    covered: int
    boxes: list[FloatArray]
    strange: Strangers


@dataclass
class _Search:
    """What is sought in which image.

    Attributes:
        grey: (height, width) image.
        pattern: What is sought.
        witnesses: Spots among which a grid lay that others between or beyond its discs refute.
    """

    grey: GreyImage
    pattern: Pattern
    witnesses: list[Spots] = field(default_factory=list)


def find_discs(grey: GreyImage, pattern: Pattern) -> Discs | str:
    """Return a grid of discs, dark or light, or the reason why there is none.

    Args:
        grey: (height, width) image.
        pattern: What is sought.
    """
    attempts = disc_reasons.Attempts(len(pattern.lattice), pattern.name)
    search = _Search(grey, pattern)
    for step in ladder(grey.shape):
        if not step.telling and (len(pattern.lattice) < _BY_CHANCE or attempts.refused):
            break
        spots = spots_of(grey, step)
        misses = []
        for part in grow(spots, pattern.reach, pattern.larger, enough=len(pattern.lattice)):
            found = _arranged(search, step, spots, part)
            if isinstance(found, Discs):
                return found
            misses.append(found)
        if not step.telling:
            continue
        attempts.saw(spots.widths)
        for miss in misses:
            attempts.fitted(miss.covered, miss.boxes, grey.shape)
            attempts.refuted(miss.strange.between, miss.strange.beyond)
    return attempts.reason(grey)


def _arranged(search: _Search, step: Step, spots: Spots, part: Cells) -> Discs | _Miss:
    """Return the discs of a part of a lattice, measured, if they are the declared ones."""
    pattern = search.pattern
    candidates, covered = best_places(pattern.places, part.places)
    found, strange = [], Strangers()
    whole, several = covered == len(pattern.places), len(candidates) > 1
    # of several places for a whole grid none is right; spots beside the part may complete another
    if not several if whole else part.settled:
        for places in candidates[:_MOST_WINDOWS]:
            expected = _expected(places, pattern, spots, part)
            discs = _measured(search, step, expected)
            if discs is not None:
                found.append((discs, expected))
    if len(found) == 1:
        discs, expected = found[0]
        strange = _strangers(search, spots, discs, expected)
        if not any(strange):
            return discs
    if any(strange) or (whole and several):
        search.witnesses.append(spots)
    boxes = [_boxes(places, part.homography, pattern.reach) for places in candidates]
    return _Miss(covered, boxes, strange)


def _strangers(search: _Search, spots: Spots, discs: Discs, expected: _Expected) -> Strangers:
    """Return what refutes a grid, by the spots it lies among or those of earlier steps."""
    for seen in [spots, *search.witnesses]:
        strange = strangers(seen, discs.pixels, expected.jacobian, expected.places)
        if any(strange):
            return strange
    return Strangers()


def _expected(places: IntArray, pattern: Pattern, spots: Spots, part: Cells) -> _Expected:
    """Return the discs at (n, 2) places, going by the spots at them and the plane of all spots."""
    spot_at = dict(zip(_pairs(part.places), part.members.tolist(), strict=True))
    members = np.array([spot_at.get(place, -1) for place in _pairs(places)])
    known = members >= 0
    seats, jacobian = _projected(part.homography, places)
    off = np.where(known[:, None], spots.centres[members] - seats, 0.0)
    likely = _smooth(pattern.closeness, off, known)
    odd = _pitches(jacobian, off - likely) > _ODD_SPOT
    if (odd & known).any():
        known &= ~odd
        likely = _smooth(pattern.closeness, off, known)
    shapes = jacobian / pattern.reach
    if pattern.larger > 1.0:
        sizes = np.abs(determinants(spots.shapes[members]) / determinants(shapes))
        wide = known & (sizes > _WIDE)
        shapes[wide] = spots.shapes[members[wide]]
    centres = seats + np.where(known[:, None], off, likely)
    return _Expected(places, centres, shapes, known, seats, jacobian)


def _pairs(places: IntArray) -> Iterator[tuple[int, int]]:
    """Return (n, 2) places one by one, each as a key of a dictionary."""
    x, y = places.T.tolist()
    return zip(x, y, strict=True)


def _boxes(places: IntArray, homography: FloatArray, reach: float) -> FloatArray:
    """Return the (n, 2, 2) least and largest x and y of discs at places."""
    centres, jacobian = _projected(homography, places)
    extent = np.hypot(jacobian[..., 0], jacobian[..., 1]) / reach
    return np.stack([centres - extent, centres + extent], axis=1)


def _smooth(closeness: FloatArray, off: FloatArray, known: BoolArray) -> FloatArray:
    """Return what (n, 2) offsets should be, going by the other known ones around.

    The lens bends a grid smoothly: a disc is off its place as its neighbours are.
    """
    # the sums of the offsets and that of the weights in one product
    summed = np.ones((len(off), 3))
    summed[:, :2] = off
    summed *= known[:, None]
    summed = closeness @ summed
    return np.asarray(summed[:, :2] / np.maximum(summed[:, 2:], 1e-12))


def _pitches(jacobian: FloatArray, off: FloatArray) -> FloatArray:
    """Return the (n,) lengths of offsets in pixels as pitches of the lattice there."""
    places = mapped_back(jacobian, off)
    return np.asarray(np.hypot(places[..., 0], places[..., 1]))


def _projected(homography: FloatArray, places: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the (n, 2) pixels of places and the (n, 2, 2) derivatives by the places."""
    seen = places @ homography[:, :2].T + homography[:, 2]
    pixels = seen[:, :2] / seen[:, 2:]
    slope = homography[:2, :2] - pixels[:, :, None] * homography[2, :2]
    return pixels, slope / seen[:, 2, None, None]


def _complete(expected: _Expected, size: tuple[int, ...]) -> bool:
    """Say whether so many discs are spots that the others may be sought at their places."""
    known = expected.known
    if known.all():
        return True
    absent = disc_outlines.inside(expected.centres, expected.shapes, size) & ~known
    few = np.count_nonzero(absent) <= max(1.0, _ABSENT * len(known))
    return bool(few and np.count_nonzero(known) >= 4)


def _square(outlines: Outlines) -> bool:
    """Say whether the discs have four corners, as those of a chessboard, all in one direction."""
    sure = outlines.sure
    corners = math.hypot(*outlines.corners[sure].sum(axis=0)) / np.count_nonzero(sure)
    if corners <= _CORNERS:
        return False
    width = 2.0 * math.sqrt(abs(typical(determinants(outlines.shapes[sure]))))
    return bool(corners > _CORNERS + _CORNERS_PX / width)


def _measured(search: _Search, step: Step, expected: _Expected) -> Discs | None:
    """Return the discs near where they are expected, or None when they are no grid in a plane."""
    grey, pattern = search.grey, search.pattern
    if not _complete(expected, grey.shape):
        return None
    outlines = disc_outlines.measure(
        255 - grey if step.light else grey,
        expected.centres,
        expected.shapes,
        pattern.reach,
        known=expected.known,
        doubt=_DOUBT * (step.factor + 1),
    )
    whole, sure = outlines.whole, outlines.sure
    enough = max(4.0, _SURE * np.count_nonzero(whole))
    if not outlines.seen.all() or np.count_nonzero(sure) < enough:
        return None
    if typical(outlines.ragged[sure]) > _ANGULAR or _square(outlines):
        return None
    off = outlines.centres - expected.seats
    alone = off - _smooth(pattern.closeness, off, sure)
    odd, misfit = _pitches(expected.jacobian, np.array([alone, off]))
    if odd[sure].max() > _ODD or typical(odd[sure]) > _LOOSE or misfit[sure].max() > _MISFIT:
        return None
    centres = outlines.centres
    # the edge of a shadow moves the outline of a disc: its neighbours tell better where it is
    moved = ~sure | (~outlines.even & (odd > _MOVED))
    if moved.any():
        likely = expected.seats + _smooth(pattern.closeness, off, ~moved)
        centres = np.where(moved[:, None], likely, centres)
    areas = np.abs(determinants(outlines.shapes) / determinants(expected.jacobian))
    return Discs(centres, 2.0 * np.sqrt(areas), whole)
