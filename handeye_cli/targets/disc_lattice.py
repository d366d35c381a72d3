"""Spots that lie on a square lattice, whatever the perspective.

A disc's own ellipse is what the view makes of a circle there. In the coordinates in which it is the
unit circle, the neighbours lie at one known distance and at right angles, so the lattice grows from
neighbour to neighbour and needs no model of the camera.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import KDTree

from handeye_cli.records import FloatArray, IntArray
from handeye_cli.targets.disc_spots import BoolArray, Spots, determinants

_NEAR = (0.72, 1.32)
"""Distance of neighbours over the expected one; sqrt(2) would be the diagonal."""
_TURN = 0.3
"""Radians by which the direction to a neighbour may be off the axes of the disc's cross."""
_ALIKE = 2.2
"""Largest ratio of the areas of neighbours."""
_ASTRAY = 0.3
"""Pitches by which a spot may be off its place; lens distortion bends a grid by less."""
_SIZES = (0.65, 1.4)
"""Width of a spot over the expected one."""
_AROUND = 12
"""Nearest spots among which the four neighbours are, even at a tilt of 70 degrees."""
_STEPS = ((1, 0), (0, 1), (-1, 0), (0, -1))
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
    parts = sorted(_parts(_neighbours(spots, reach)), key=len, reverse=True)
    for part in parts[:_MOST]:
        cells = _settled(spots, part, reach, larger)
        if cells is not None:
            yield cells


def _neighbours(spots: Spots, reach: float) -> IntArray:
    """Return the (n, 4) neighbours in the directions of each spot's own cross, -1 for none."""
    count = min(_AROUND, len(spots) - 1)
    near = KDTree(spots.centres).query(spots.centres, k=count + 1)[1][:, 1:]
    apart = spots.centres[near] - spots.centres[:, None]
    to_circle = np.linalg.inv(spots.shapes)
    seen = np.einsum("nab,nkb->nka", to_circle, apart)
    back = np.einsum("nkab,nkb->nka", to_circle[near], apart)
    there, here = (np.linalg.norm(each, axis=-1) / reach for each in (seen, back))
    area = spots.widths**2
    ratio = area[near] / area[:, None]
    linked = (np.minimum(there, here) > _NEAR[0]) & (np.maximum(there, here) < _NEAR[1])
    linked &= (ratio < _ALIKE) & (ratio > 1.0 / _ALIKE)
    angle = np.arctan2(seen[..., 1], seen[..., 0])
    cross = np.angle(np.sum(linked * np.exp(4j * angle), axis=1)) / 4.0
    quarters = (angle - cross[:, None]) / (np.pi / 2)
    off = np.abs(quarters - np.rint(quarters)) * (np.pi / 2)
    cost = np.where(linked & (off < _TURN), np.abs(there - 1.0) + off, np.inf)
    direction = np.rint(quarters).astype(np.int64) % 4
    in_turn = np.where(direction[..., None] == np.arange(4), cost[..., None], np.inf)
    best = np.take_along_axis(near, in_turn.argmin(axis=1), axis=1)
    return np.where(np.isfinite(in_turn.min(axis=1)), best, -1)


def _parts(neighbours: IntArray) -> list[dict[int, tuple[int, int]]]:
    """Return the joined parts of at least 4 spots, each a map from spots to places."""
    table = neighbours.tolist()
    free = set(range(len(table)))
    parts = []
    degrees = np.sum(neighbours >= 0, axis=1)
    for seed in np.argsort(-degrees, kind="stable")[: np.sum(degrees >= 2)].tolist():
        if seed in free:
            part = _walk(table, seed, free)
            free -= part.keys()
            if len(part) >= 4:
                parts.append(part)
    return parts


def _walk(table: list[list[int]], seed: int, free: set[int]) -> dict[int, tuple[int, int]]:
    """Return the places of the spots that are joined with a seed, breadth first."""
    places, turns, taken = {seed: (0, 0)}, {seed: 0}, {(0, 0)}
    queue = deque([seed])
    while queue:
        here = queue.popleft()
        for k, there in enumerate(table[here]):
            if there < 0 or there in places or there not in free or here not in table[there]:
                continue
            step = _STEPS[(k + turns[here]) % 4]
            place = (places[here][0] + step[0], places[here][1] + step[1])
            if place in taken:
                continue
            places[there] = place
            # seen from there, the way back is the opposite of the way forth
            turns[there] = (k + turns[here] + 2 - table[there].index(here)) % 4
            taken.add(place)
            queue.append(there)
    return places


def _settled(
    spots: Spots, part: dict[int, tuple[int, int]], reach: float, larger: float
) -> Cells | None:
    """Return a part without what does not fit a plane, and with all spots beside it that do."""
    members = np.array(list(part), dtype=np.int64)
    places = np.array(list(part.values()), dtype=np.int64)
    back, fitting = _plane(spots.centres[members], places, cv2.RANSAC)
    for _ in range(_ROUNDS):
        if back is None or np.sum(fitting) < 4:
            return None
        kept = fitting
        found = _fitting(spots, back, (members[kept], places[kept]), reach, larger)
        if len(found[0]) < 4 or np.linalg.matrix_rank(found[1] - found[1][0]) < 2:
            return None
        same = np.array_equal(np.sort(found[0]), np.sort(members))
        members, places = found
        back, fitting = _plane(spots.centres[members], places)
        if same:
            break
    if back is None or abs(np.linalg.det(back)) < 1e-12:
        return None
    return Cells(members, places, np.asarray(np.linalg.inv(back), dtype=np.float64))


def _plane(
    pixels: FloatArray, places: IntArray, method: int = 0
) -> tuple[FloatArray | None, BoolArray]:
    """Return the (3, 3) homography from pixels to places, if any, and which points it fits."""
    found, fitting = cv2.findHomography(pixels, places.astype(np.float64), method, _ASTRAY)
    homography = np.asarray(found, dtype=np.float64) if np.shape(found) == (3, 3) else None
    return homography, np.ravel(fitting) > 0


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
    depth = seen[:, 2] * np.sign(np.median(seen[known[0], 2]))
    front = depth > 1e-9
    position = seen[:, :2] / np.where(front, seen[:, 2], 1.0)[:, None]
    place = np.rint(np.clip(position, -1e6, 1e6)).astype(np.int64)
    off = np.linalg.norm(position - place, axis=1)
    scale = np.abs(np.linalg.det(back)) / np.where(front, depth, 1.0) ** 3
    size = reach * np.sqrt(determinants(spots.shapes) * scale)
    fits = front & (off < _ASTRAY) & (size > _SIZES[0]) & (size < _SIZES[1] * larger)
    chosen = np.flatnonzero(fits & _beside(place, known[1]))
    chosen = chosen[np.argsort(off[chosen], kind="stable")]
    _, first = np.unique(place[chosen], axis=0, return_index=True)
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
