"""Why no chessboard was found, from what the search saw on its way."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from handeye_cli.records import FloatArray, IntArray
from handeye_cli.targets import image_sides
from handeye_cli.targets.saddle_lattice import Part

_FEW = 0.4
"""Least share of the corners from which on it is told where the others are."""
_OUTSIDE = 0.9
"""Least share of the missing corners that lie outside of an image that cuts the board."""


@dataclass
class Attempts:
    """The best that was seen of a chessboard so far.

    Attributes:
        columns: Inner corners in a row.
        rows: Rows of inner corners.
        covered: Largest number of corners on one lattice, where those of the board should be.
        other: Columns and rows of the board that these corners make, when it is another one.
        sides: Sides of the image beyond which the missing corners lie.
        larger: Whether another row or column of corners lies beside those of the board.
    """

    columns: int
    rows: int
    covered: int = 0
    other: tuple[int, int] | None = None
    sides: list[str] = field(default_factory=list)
    larger: bool = False

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
        most = max(
            (_leaving(part.located(each), size) for each in places), key=lambda each: each.outside
        )
        if most.outside >= _OUTSIDE * (total - covered) > 0:
            self.sides = most.sides
        elif full and not same and extent.min() >= 2:
            self.other = (int(extent.max()), int(extent.min()))

    def reason(self) -> str:
        """Return the most telling reason for an image without the board."""
        total, name = self.columns * self.rows, f"{self.columns}x{self.rows}"
        if self.other is not None and self.covered >= _FEW * total:
            other = f"{self.other[0]}x{self.other[1]}"
            return f"{other} inner corners of a chessboard were found, not {name}"
        if self.larger:
            return f"the corners go on beyond {name}: the board is a larger one"
        if self.covered == total:
            return f"the corners go on beyond {name}: the declared board fits several places"
        if self.sides and self.covered >= _FEW * total:
            where = image_sides.named(self.sides)
            return f"{self.covered} of {total} corners: the board leaves the image {where}"
        missing = f"no chessboard of {name} inner corners was found"
        if self.covered < 4:
            return missing
        return f"{missing}: at most {self.covered} of {total} corners lie on one"


def _leaving(pixels: FloatArray, size: tuple[int, ...]) -> image_sides.Leaving:
    return image_sides.leaving(np.stack([pixels, pixels], axis=1), size)
