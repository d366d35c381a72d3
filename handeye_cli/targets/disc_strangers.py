"""Discs that the declared layout leaves no room for: with several of them the plate is another one.

Every second disc of a dense grid is a grid, too, and so are all but its last row. What tells them
from the declared plate is what else lies on the paper: discs as large as the others between them,
or where the next row would be.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from handeye_cli.geometry.light_slopes import typical
from handeye_cli.geometry.two_by_two import determinants, mapped_back
from handeye_cli.records import FloatArray, IntArray
from handeye_cli.targets.disc_spots import Spots

_ALIKE = (0.8, 1.25)
"""Width of a stranger over that of the layout's own discs."""
_OWN, _NEXT = 0.3, 0.2
"""Pitches within which a spot is a disc of the layout, or at a place beside it."""
_BETWEEN, _BESIDE = 0.8, 1.3
"""Pitches within which a spot has two discs if it lies between some, or one if in a next row."""
_FEWEST = 3
_BETWEEN_SHARE, _ROW_SHARE = 0.15, 0.6
"""Strangers that chance does not explain: a number, and a share of all discs or of a row."""


class Strangers(NamedTuple):
    """How many discs have no place in a layout; none where it may be chance.

    Attributes:
        between: Those between its discs.
        beyond: Those that go on with its lattice.
    """

    between: int = 0
    beyond: int = 0


def strangers(
    spots: Spots, centres: FloatArray, jacobian: FloatArray, places: IntArray
) -> Strangers:
    """Return how many spots look like discs of a layout but have no place in it.

    Args:
        spots: All spots of the image.
        centres: (n, 2) middles of the layout's discs, pixels.
        jacobian: (n, 2, 2) derivatives of the pixels by the places there.
        places: (n, 2) their places on the lattice.
    """
    near = _near(spots.centres, centres, jacobian)
    seen, shapes = spots.centres[near], spots.shapes[near]
    nearest = np.argmin(_squares(seen, centres), axis=1)
    aside = mapped_back(jacobian[nearest], seen - centres[nearest])
    own = np.hypot(aside[:, 0], aside[:, 1]) < _OWN
    # fewer than some of them are taken for chance, whatever they are
    if not 0 < np.count_nonzero(own) <= len(own) - _FEWEST:
        return Strangers()
    width = np.sqrt(np.abs(determinants(shapes) / determinants(jacobian)[nearest]))
    width /= typical(width[own])
    others = np.flatnonzero(~own & (width > _ALIKE[0]) & (width < _ALIKE[1]))
    if len(others) < _FEWEST:
        return Strangers()
    position = places[nearest[others]] + aside[others]
    off = position - np.rint(position)
    first, second = np.partition(_squares(position, places), 1, axis=1)[:, :2].T
    between = second < _BETWEEN**2
    beyond = ~between & (first < _BESIDE**2) & (np.hypot(off[:, 0], off[:, 1]) < _NEXT)
    count = len(places)
    return Strangers(
        _unlikely(int(between.sum()), _BETWEEN_SHARE * count),
        _unlikely(int(beyond.sum()), _ROW_SHARE * math.sqrt(count)),
    )


def _near(points: FloatArray, centres: FloatArray, jacobian: FloatArray) -> IntArray:
    """Return the indices of the points that are not far outside of all the centres."""
    # in x or y, no way of so many pitches is longer
    margin = 2.0 * _BESIDE * float(np.abs(jacobian).max())
    low, high = centres.min(axis=0) - margin, centres.max(axis=0) + margin
    within = (points > low) & (points < high)
    return np.flatnonzero(within[:, 0] & within[:, 1])


def _squares(here: FloatArray, there: FloatArray | IntArray) -> FloatArray:
    """Return the (m, n) squared distances between (m, 2) and (n, 2) points."""
    x, y = here[:, :1] - there[:, 0], here[:, 1:] - there[:, 1]
    return np.asarray(x * x + y * y)


def _unlikely(count: int, least: float) -> int:
    """Return the count if it is too large for chance, else 0."""
    return count if count >= max(_FEWEST, least) else 0
