"""Spots that lie on a square lattice, whatever the perspective.

A disc's own ellipse is what the view makes of a circle there. In the coordinates in which it is the
unit circle, the neighbours lie at one known distance and at right angles, so the lattice grows from
neighbour to neighbour and needs no model of the camera.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from handeye_cli.geometry.two_by_two import determinants
from handeye_cli.records import FloatArray, IntArray
from handeye_cli.targets.disc_spots import BoolArray, Spots
from handeye_cli.targets.lattice_plane import agreed_plane, nearest_plane
from handeye_cli.targets.lattice_walk import joined_parts

ComplexArray = NDArray[np.complex128]

_NEAR = (0.72, 1.32)
"""Distance of neighbours over the expected one; sqrt(2) would be the diagonal."""
_TURN = 0.3
"""Sine of the angle by which a neighbour may be off the axes of the disc's cross."""
_ALIKE = 2.2
"""Largest ratio of the areas of neighbours."""
_ASTRAY = 0.3
"""Pitches by which a spot may be off its place; lens distortion bends a grid by less."""
_SIZES = (0.65, 1.4)
"""Width of a spot over the expected one."""
_AROUND = 12
"""Nearest spots among which the four neighbours are, even at a tilt of 70 degrees."""
_FEW = 100
"""Spots up to which a table of all distances is quicker than a tree."""
_ROUNDS = 6
_MOST = 3
"""Parts of a lattice that are looked at."""


class Cells(NamedTuple):
    """Spots with their places on a lattice.

    Attributes:
        members: (m,) indices of the spots.
        places: (m, 2) whole-numbered places; their axes turn as those of the image do.
        homography: (3, 3) from places to pixels, lens distortion aside.
        settled: Whether spots beside them were looked for that fit as well.
    """

    members: IntArray
    places: IntArray
    homography: FloatArray
    settled: bool


def grow(spots: Spots, reach: float, larger: float, *, enough: float = math.inf) -> Iterator[Cells]:
    """Yield the parts of a lattice that spots lie on, the largest first.

    A part that may be enough as it is comes unsettled, and once more when that is refused.

    Args:
        spots: What may be discs.
        reach: Distance of neighbours in radii of a disc.
        larger: Radius of the largest disc in radii of the others.
        enough: Number of spots from which on a part may be enough.
    """
    if len(spots) < 4:
        return
    parts = joined_parts(_neighbours(spots, reach))
    for members, places in parts[:_MOST]:
        back, fitting = agreed_plane(spots.centres[members], places, _ASTRAY)
        part = members[fitting], places[fitting]
        cells = _cells(part, back, settled=False) if len(part[0]) >= enough else None
        if cells is not None:
            yield cells
        cells = _settled(spots, part, back, reach, larger)
        if cells is not None:
            yield cells


def _neighbours(spots: Spots, reach: float) -> IntArray:
    """Return the (n, 4) neighbours in the directions of each spot's own cross, -1 for none."""
    others = _others(spots.centres)
    centres = np.ascontiguousarray(spots.centres).view(np.complex128)[:, 0]
    apart = centres[others] - centres[:, None]
    to_pitches = _inverses(reach * spots.shapes)
    towards, near = _seen(to_pitches[..., None], apart)
    pairs = near.ravel().nonzero()[0]
    here, there = pairs // others.shape[1], others.ravel()[pairs]
    # a neighbour is of like size and sees the spot as its neighbour, too
    areas = determinants(spots.shapes)
    ratio = areas[there] / areas[here]
    mutual = _seen(to_pitches[:, there], apart.ravel()[pairs])[1]
    mutual &= (ratio < _ALIKE) & (ratio > 1.0 / _ALIKE)
    towards = towards.ravel()[pairs]
    return _table(len(areas), here[mutual], there[mutual], towards[mutual])


def _table(count: int, here: IntArray, there: IntArray, towards: ComplexArray) -> IntArray:
    """Return the (n, 4) neighbours along the cross that turns best to all neighbours of a spot.

    Args:
        count: Number n of spots.
        here: (m,) spots.
        there: (m,) their neighbours.
        towards: (m,) where these are, x + iy in pitches.
    """
    distance = np.abs(towards)
    towards = towards / distance
    # the fourth power is the same for all four directions of a cross
    fourth = (towards * towards) ** 2
    sums = (np.bincount(here, part, count) for part in (fourth.imag, fourth.real))
    towards *= np.exp(-0.25j * np.arctan2(*sums))[here]
    along, across = np.abs(towards.real), np.abs(towards.imag)
    level, off = along > across, np.minimum(along, across)
    opposite = np.where(level, towards.real, towards.imag) < 0.0
    direction = 2 * opposite + ~level
    # of several in one direction, the last one stays
    order = np.argsort(-np.abs(distance - 1.0) - off, kind="stable")
    order = order[off[order] < _TURN]
    found = np.full((count, 4), -1)
    found[here[order], direction[order]] = there[order]
    return found


def _others(centres: FloatArray) -> IntArray:
    """Return the (n, k) nearest other spots of each spot."""
    count = min(_AROUND, len(centres) - 1)
    if len(centres) <= _FEW:
        x, y = centres.T
        across, down = x[:, None] - x, y[:, None] - y
        square = across * across + down * down
        np.fill_diagonal(square, np.inf)
        return np.argpartition(square, count - 1, axis=1)[:, :count]
    tree = cKDTree(centres, compact_nodes=False, balanced_tree=False)
    return np.asarray(tree.query(centres, k=count + 1)[1][:, 1:])


def _inverses(matrices: FloatArray) -> ComplexArray:
    """Return (2, n) p and q such that z = x + iy times the inverse of a matrix is p z + q z*.

    These products are quicker than those of many small matrices with vectors.
    """
    (a, b), (c, d) = matrices.transpose(1, 2, 0)
    inverses = np.array([(a + d) + 1j * (b - c), (d - a) - 1j * (b + c)])
    inverses *= 0.5 / (a * d - b * c)
    return inverses


def _seen(to_pitches: ComplexArray, apart: ComplexArray) -> tuple[ComplexArray, BoolArray]:
    """Return where spots see others, x + iy in pitches, and whether at a neighbour's distance.

    Args:
        to_pitches: (2, ...) maps of pixels to the coordinates in which a disc is a circle, see
            `_inverses`.
        apart: (...) ways to the others, x + iy in pixels.
    """
    direct, mirrored = to_pitches
    towards = direct * apart + mirrored * apart.conj()
    distance = np.abs(towards)
    return towards, np.asarray((distance > _NEAR[0]) & (distance < _NEAR[1]))


def _settled(
    spots: Spots,
    part: tuple[IntArray, IntArray],
    back: FloatArray | None,
    reach: float,
    larger: float,
) -> Cells | None:
    """Return a part without what does not fit a plane, and with all spots beside it that do."""
    members, places = part
    for _ in range(_ROUNDS):
        if back is None or _in_line(places):
            return None
        found = _fitting(spots, back, (members, places), reach, larger)
        same = set(found[0].tolist()) == set(members.tolist())
        members, places = found
        if same:
            break
        back = nearest_plane(spots.centres[members], places)
    return _cells((members, places), back, settled=True)


def _cells(
    part: tuple[IntArray, IntArray], back: FloatArray | None, *, settled: bool
) -> Cells | None:
    """Return a part with the inverse of the (3, 3) homography from pixels, if there is one."""
    if back is None or abs(cv2.determinant(back)) < 1e-12:
        return None
    return Cells(*part, np.asarray(cv2.invert(back)[1], dtype=np.float64), settled)


def _in_line(places: IntArray) -> bool:
    """Say whether (n, 2) places all lie on one straight line."""
    x, y = (places - places[0]).T
    return bool((x @ x) * (y @ y) == (x @ y) ** 2)


def _fitting(
    spots: Spots, back: FloatArray, known: tuple[IntArray, IntArray], reach: float, larger: float
) -> tuple[IntArray, IntArray]:
    """Return the spots, and their places, that lie on or beside the known part of a lattice.

    Args:
        spots: All spots.
        back: (3, 3) from pixels to places.
        known: (m,) members and (m, 2) places.
        reach: Distance of neighbours in radii of a disc.
        larger: Radius of the largest disc in radii of the others.
    """
    seen = spots.centres @ back[:, :2].T + back[:, 2]
    depth = seen[:, 2] * np.sign(np.sum(seen[known[0], 2]))
    front = depth > 1e-9
    position = seen[:, :2] / np.where(front, seen[:, 2], 1.0)[:, None]
    place = np.rint(np.clip(position, -1e6, 1e6)).astype(np.int64)
    off = np.hypot(*(position - place).T)
    scale = abs(cv2.determinant(back)) / np.where(front, depth, 1.0) ** 3
    size = reach * np.sqrt(determinants(spots.shapes) * scale)
    fits = front & (off < _ASTRAY) & (size > _SIZES[0]) & (size < _SIZES[1] * larger)
    chosen = np.flatnonzero(fits)
    chosen = chosen[_beside(place[chosen], known[1])]
    # one spot for each place, the nearest
    chosen = chosen[np.lexsort((off[chosen], *place[chosen].T))]
    place = place[chosen]
    first = np.ones(len(chosen), dtype=np.bool_)
    first[1:] = np.any(place[1:] != place[:-1], axis=1)
    return chosen[first], place[first]


def _beside(places: IntArray, known: IntArray) -> BoolArray:
    """Say which (n, 2) places are among the known or next to one, diagonals included."""
    first = known.min(axis=0) - 2
    size = known.max(axis=0) - first + 3
    near = np.zeros(size, dtype=np.uint8)
    near[tuple((known - first).T)] = 1
    near = cv2.dilate(near, np.ones((3, 3), dtype=np.uint8))
    at = np.clip(places - first, 0, size - 1)
    return np.asarray(near[tuple(at.T)] > 0)
