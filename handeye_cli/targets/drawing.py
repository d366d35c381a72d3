"""What a target looks like: dark discs and rectangles on a light plate.

A drawing is all that a renderer or a printer needs to know of a target, and it holds nothing of how
the target is found in an image.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from handeye_cli.records import FloatArray


def _endless() -> FloatArray:
    return np.array([[-np.inf, -np.inf], [np.inf, np.inf]])


@dataclass(frozen=True)
class Drawing:
    """Dark shapes on light paper, in metres in the target's frame; shapes touch, none overlap.

    Attributes:
        discs: (n, 3) centre x, y and radius.
        rectangles: (m, 4) x0, y0, x1, y1 with x0 < x1 and y0 < y1.
        outline: (2, 2) smallest and largest x, y of the plate; infinite for paper without an end.
    """

    discs: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    rectangles: FloatArray = field(default_factory=lambda: np.zeros((0, 4)))
    outline: FloatArray = field(default_factory=_endless)

    @property
    def endless(self) -> bool:
        """Whether there is paper everywhere."""
        return bool(np.isinf(self.outline).all())


def outline_around(shapes: FloatArray, margin: float) -> FloatArray:
    """Return the (2, 2) outline of a plate that ends a margin beyond points or rectangles."""
    points = shapes.reshape(-1, 2)
    return np.stack([points.min(axis=0) - margin, points.max(axis=0) + margin])


def checkers(columns: int, rows: int, side: float, *, dark_first: bool = True) -> FloatArray:
    """Return the (m, 4) dark squares of a chessboard whose top left corner is the origin.

    Args:
        columns: Squares in a row.
        rows: Rows of squares.
        side: Of a square.
        dark_first: Whether the square at the top left is dark.
    """
    row, column = np.indices((rows, columns))
    return dark_cells((row + column) % 2 == (0 if dark_first else 1), side)


def dark_cells(dark: NDArray[np.bool_], side: float) -> FloatArray:
    """Return the dark parts of an array of square cells, merged along its rows.

    Args:
        dark: (rows, columns) which of the cells are dark.
        side: Of a cell, in any unit.

    Returns:
        (m, 4) rectangles x0, y0, x1, y1 from the array's top left corner, in that unit.
    """
    steps = np.diff(np.pad(dark.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    # Both lists run row by row, so that start k and end k are of one run.
    row, start = np.nonzero(steps == 1)
    _, end = np.nonzero(steps == -1)
    return np.asarray(np.stack([start, row, end, row + 1], axis=1) * side, dtype=np.float64)
