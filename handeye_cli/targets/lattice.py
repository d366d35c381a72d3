"""Regular layouts of points in whole half pitches, where symmetries are exact.

A lattice is an (n, 2) array of whole numbers, x to the right and y down in half pitches. What a
detector returns is in the order of the lattice up to a turn and perhaps a mirroring; the functions
here list the orders that are possible.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from handeye_cli.records import FloatArray, IntArray

_QUARTER = np.array([[0, -1], [1, 0]])
_MIRROR = np.array([[-1, 0], [0, 1]])


@lru_cache(maxsize=64)
def grid(columns: int, rows: int) -> IntArray:
    """Return the (rows * columns, 2) lattice of a rectangular grid, row by row; read-only."""
    row, column = np.divmod(np.arange(rows * columns, dtype=np.int64), columns)
    places = 2 * np.stack([column, row], axis=1)
    places.setflags(write=False)
    return places


def flat_points(positions: IntArray | FloatArray, unit: float) -> FloatArray:
    """Return (n, 2) positions in multiples of `unit` as (n, 3) points at z = 0."""
    points = np.zeros((len(positions), 3))
    points[:, :2] = positions
    points *= unit
    return points


def symmetries(
    lattice: IntArray, marks: IntArray | None = None, *, mirrored: bool = False
) -> tuple[IntArray, ...]:
    """Return the permutations by which a lattice falls onto itself.

    Args:
        lattice: (n, 2) lattice.
        marks: (m, 2 + k) what else must fall onto itself: positions in the lattice's units, and
            k numbers for the looks there.
        mirrored: Whether to turn the mirrored lattice, instead of the lattice itself.

    Returns:
        (n,) arrays p, in the order of the quarter turns: point k falls onto point p[k]. The first
        is the identity, unless mirrored.
    """
    # twice the positions, so that the middle is a whole number too
    middle = lattice.min(axis=0) + lattice.max(axis=0)
    places = 2 * lattice - middle
    looks = np.zeros((0, 2), dtype=np.int64) if marks is None else marks
    spots = np.concatenate([2 * looks[:, :2] - middle, looks[:, 2:]], axis=1)
    found = []
    motion = _MIRROR if mirrored else np.eye(2, dtype=np.int64)
    for _ in range(4):
        order = _onto(places @ motion.T, places)
        turned = np.concatenate([spots[:, :2] @ motion.T, spots[:, 2:]], axis=1)
        if order is not None and _onto(turned, spots) is not None:
            found.append(order)
        motion = _QUARTER @ motion
    return tuple(found)


def _onto(moved: IntArray, still: IntArray) -> IntArray | None:
    """Return p with `moved[k] == still[p[k]]`, or None when they are not the same rows."""
    order_moved, order_still = np.lexsort(moved.T), np.lexsort(still.T)
    if not np.array_equal(moved[order_moved], still[order_still]):
        return None
    p = np.empty(len(moved), dtype=np.int64)
    p[order_moved] = order_still
    return p


def right_handed(lattice: IntArray, pixels: FloatArray) -> tuple[IntArray, ...]:
    """Return the orders of detected points that show the lattice from its front.

    Args:
        lattice: (n, 2) lattice.
        pixels: (n, 2) its points in the image, in an order that is right up to a turn or mirroring.

    Returns:
        (n,) orders o, so that `pixels[o]` are points 0, 1, ...; none when the pixels are mirrored
        and the lattice has no mirror symmetry.
    """
    (a, b), (c, d) = ((lattice - lattice.mean(axis=0)).T @ pixels).tolist()
    return _orders(np.ascontiguousarray(lattice, dtype=np.int64).tobytes(), a * d < b * c)


@lru_cache(maxsize=64)
def _orders(lattice: bytes, mirrored: bool) -> tuple[IntArray, ...]:
    """Return the symmetries of a lattice, which every image of a recording asks for."""
    orders = symmetries(np.frombuffer(lattice, np.int64).reshape(-1, 2), mirrored=mirrored)
    for order in orders:
        order.setflags(write=False)
    return orders


def first_in_image(pixels: FloatArray, orders: Sequence[IntArray]) -> IntArray:
    """Return the order whose point 0 is nearest to the top left of the image."""
    starts = pixels[[order[0] for order in orders]].sum(axis=1)
    return orders[int(starts.argmin())]
