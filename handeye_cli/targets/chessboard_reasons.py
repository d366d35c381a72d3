"""Why no chessboard was found, from what the search saw on its way."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from handeye_cli.records import FloatArray, IntArray
from handeye_cli.targets.saddle_lattice import Part

_FEW = 0.4
"""Least share of the corners from which on it is told where the others are."""


@dataclass
class Attempts:
    """The best that was seen of a chessboard so far.

    Attributes:
        columns: Inner corners in a row.
        rows: Rows of inner corners.
        covered: Largest number of corners on one lattice, where those of the board should be.
        other: Columns and rows of the board that these corners make, when it is another one.
        sides: Sides of the image beyond which the missing corners lie.
    """

    columns: int
    rows: int
    covered: int = 0
    other: tuple[int, int] | None = None
    sides: list[str] = field(default_factory=list)

    def saw(self, part: Part, places: list[IntArray], covered: int, size: tuple[int, ...]) -> None:
        """Note a part of a lattice.

        Args:
            part: The part.
            places: The ways in which the board can be laid over it to cover the most of it.
            covered: Corners of the board that are there.
            size: Height and width of the image.
        """
        if covered <= self.covered:
            return
        self.covered, self.sides, self.other = covered, [], None
        total = self.columns * self.rows
        extent = np.ptp(part.places, axis=0) + 1
        full = len(part.places) == np.prod(extent)
        same = sorted(extent.tolist()) == sorted((self.columns, self.rows))
        outside = [_outside(part.located(each), size) for each in places]
        best = max(outside, key=lambda each: int(each.any(axis=1).sum()))
        if best.any(axis=1).sum() >= 0.9 * (total - covered) > 0:
            names = np.array(["left", "top", "right", "bottom"])
            self.sides = names[best.any(axis=0)].tolist()
        elif full and not same and extent.min() >= 2:
            self.other = (int(extent.max()), int(extent.min()))

    def reason(self) -> str:
        """Return the most telling reason for an image without the board."""
        total, name = self.columns * self.rows, f"{self.columns}x{self.rows}"
        if self.other is not None and self.covered >= _FEW * total:
            other = f"{self.other[0]}x{self.other[1]}"
            return f"{other} inner corners of a chessboard were found, not {name}"
        if self.covered == total:
            return f"the corners go on beyond {name}: the declared board fits several places"
        if self.sides and self.covered >= _FEW * total:
            where = " and ".join(self.sides)
            return f"{self.covered} of {total} corners: the board leaves the image on the {where}"
        missing = f"no chessboard of {name} inner corners was found"
        if self.covered < 4:
            return missing
        return f"{missing}: at most {self.covered} of {total} corners lie on one"


def _outside(pixels: FloatArray, size: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return the (n, 4) sides, left, top, right and bottom, beyond which pixels lie."""
    last = np.array(size[::-1]) - 1.0
    return np.hstack([pixels < 0.0, pixels > last])
