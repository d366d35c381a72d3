"""Spots that lie on a square lattice, whatever the perspective.

A disc's own ellipse is what the view makes of a circle there. In the coordinates in which it is the
unit circle, the neighbours lie at one known distance and at right angles, so the lattice grows from
neighbour to neighbour and needs no model of the camera.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import KDTree

from handeye_cli.records import FloatArray, IntArray
from handeye_cli.targets.disc_spots import BoolArray, Spots, determinants, mapped_back
from handeye_cli.targets.lattice_walk import joined_parts

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
_ROUNDS = 6
_MOST = 3
"""Parts of a lattice that are looked at."""


@dataclass(frozen=True)
class Cells:
    """Spots with their places on a lattice.

    Attributes:
        members: (m,) indices of the spots.
        places: (m, 2) whole-numbered places; their axes turn as those of the image do.
        homography: (3, 3) from places to pixels, lens distortion aside.
    """

    members: IntArray
    places: IntArray
    homography: FloatArray


def grow(spots: Spots, reach: float, larger: float) -> Iterator[Cells]:
    """Yield the parts of a lattice that spots lie on, the largest first.

    Args:
        spots: What may be discs.
        reach: Distance of neighbours in radii of a disc.
        larger: Radius of the largest disc in radii of the others.
    """
    if len(spots) < 4:
        return
    parts = joined_parts(_neighbours(spots, reach))
    for part in parts[:_MOST]:
        cells = _settled(spots, part, reach, larger)
        if cells is not None:
            yield cells


def _neighbours(spots: Spots, reach: float) -> IntArray:
    """Return the (n, 4) neighbours in the directions of each spot's own cross, -1 for none."""
    here, there, apart = _pairs(spots.centres)
    seen = mapped_back(spots.shapes[here], apart)
    distance = np.hypot(seen[:, 0], seen[:, 1]) / reach
    near = np.flatnonzero((distance > _NEAR[0]) & (distance < _NEAR[1]))
    near = near[_answers(spots, here[near], there[near], apart[near], reach)]
    here, there, distance = here[near], there[near], distance[near]
    towards = (seen[near, 0] + 1j * seen[near, 1]) / (reach * distance)
    # the fourth power is the same for all four directions of a cross
    fourth = (towards * towards) ** 2
    sums = (np.bincount(here, part, len(spots)) for part in (fourth.imag, fourth.real))
    towards *= np.exp(-0.25j * np.arctan2(*sums))[here]
    along, across = np.abs(towards.real), np.abs(towards.imag)
    level, off = along > across, np.minimum(along, across)
    opposite = np.where(level, towards.real, towards.imag) < 0.0
    direction = np.where(level, 0, 1) + np.where(opposite, 2, 0)
    # of several in one direction, the last one stays
    order = np.argsort(-np.abs(distance - 1.0) - off, kind="stable")
    order = order[off[order] < _TURN]
    found = np.full((len(spots), 4), -1)
    found[here[order], direction[order]] = there[order]
    return found


def _pairs(centres: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Return (m,) spots, (m,) others around each, and the (m, 2) ways to them, pixels."""
    count = min(_AROUND, len(centres) - 1)
    there = KDTree(centres).query(centres, k=count + 1)[1][:, 1:].ravel()
    here = np.repeat(np.arange(len(centres)), count)
    return here, there, centres[there] - centres[here]


def _answers(
    spots: Spots, here: IntArray, there: IntArray, apart: FloatArray, reach: float
) -> BoolArray:
    """Say which (m,) others are of like size and see the spots as neighbours, too."""
    shapes = spots.shapes[there]
    back = np.hypot(*mapped_back(shapes, apart).T) / reach
    ratio = np.abs(determinants(shapes) / determinants(spots.shapes)[here])
    near = (back > _NEAR[0]) & (back < _NEAR[1])
    return np.asarray(near & (ratio < _ALIKE) & (ratio > 1.0 / _ALIKE))


def _settled(
    spots: Spots, part: tuple[IntArray, IntArray], reach: float, larger: float
) -> Cells | None:
    """Return a part without what does not fit a plane, and with all spots beside it that do."""
    members, places = part
    back, fitting = _plane(spots.centres[members], places, cv2.RANSAC)
    members, places = members[fitting], places[fitting]
    for _ in range(_ROUNDS):
        if back is None or _in_line(places):
            return None
        found = _fitting(spots, back, (members, places), reach, larger)
        same = np.array_equal(np.sort(found[0]), np.sort(members))
        members, places = found
        if same:
            break
        back, _ = _plane(spots.centres[members], places)
    if back is None or abs(np.linalg.det(back)) < 1e-12:
        return None
    return Cells(members, places, np.asarray(np.linalg.inv(back), dtype=np.float64))


def _in_line(places: IntArray) -> bool:
    """Say whether (n, 2) places all lie on one straight line."""
    x, y = (places - places[0]).T
    return bool((x @ x) * (y @ y) == (x @ y) ** 2)


def _plane(
    pixels: FloatArray, places: IntArray, method: int = 0
) -> tuple[FloatArray | None, BoolArray]:
    """Return the (3, 3) homography from pixels to places, if any, and which points it fits."""
    none = np.zeros(len(places), dtype=np.bool_)
    if len(places) < 4:
        return None, none
    found, fitting = cv2.findHomography(pixels, places.astype(np.float64), method, _ASTRAY)
    if np.shape(found) != (3, 3):
        return None, none
    return np.asarray(found, dtype=np.float64), np.ravel(fitting) > 0


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
    scale = np.abs(np.linalg.det(back)) / np.where(front, depth, 1.0) ** 3
    size = reach * np.sqrt(determinants(spots.shapes) * scale)
    fits = front & (off < _ASTRAY) & (size > _SIZES[0]) & (size < _SIZES[1] * larger)
    chosen = np.flatnonzero(fits & _beside(place, known[1]))
    chosen = chosen[np.argsort(off[chosen], kind="stable")]
    # one spot for each place, the nearest
    span = np.ptp(known[1][:, 1]) + 3
    _, first = np.unique(place[chosen] @ [span, 1], return_index=True)
    return chosen[first], place[chosen[first]]


def _beside(places: IntArray, known: IntArray) -> BoolArray:
    """Say which (n, 2) places are among the known or next to one, diagonals included."""
    first = known.min(axis=0) - 2
    size = known.max(axis=0) - first + 3
    near = np.zeros(size, dtype=np.uint8)
    near[tuple((known - first).T)] = 1
    near = cv2.dilate(near, np.ones((3, 3), dtype=np.uint8))
    at = np.clip(places - first, 0, size - 1)
    return np.asarray(near[tuple(at.T)] > 0)
