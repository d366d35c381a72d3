"""A rectangular grid of discs, the paper's plate; one corner disc may be larger."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np

from handeye_cli.conventions import MM
from handeye_cli.records import FloatArray, GreyImage, IntArray
from handeye_cli.targets import lattice
from handeye_cli.targets.board import Detection
from handeye_cli.targets.disc_board import DiscBoard
from handeye_cli.targets.discs import Pattern, find_discs
from handeye_cli.targets.drawing import Drawing, outline_around
from handeye_cli.targets.keys import Range, refuse, require_few


@dataclass(frozen=True)
class DiscGrid(DiscBoard):
    """Discs at x = column * spacing, y = row * spacing.

    Attributes:
        rows: Rows of discs.
        columns: Discs in a row.
        spacing_mm: Distance between neighbouring centres.
        diameter_mm: Of a disc.
        corner_diameter_mm: Of the one larger corner disc, which is point 0, or None.
    """

    TYPE: ClassVar[str] = "disc-grid"
    SHORTHAND: ClassVar[str] = ":{columns}x{rows}:{spacing_mm}:{diameter_mm}[:{corner_diameter_mm}]"
    EXAMPLE: ClassVar[str] = "disc-grid:6x6:5mm:4mm"

    rows: Annotated[int, Range(2)]
    columns: Annotated[int, Range(2)]
    spacing_mm: float
    diameter_mm: float
    corner_diameter_mm: float | None = None

    def __post_init__(self) -> None:
        require_few(self.columns, self.rows, "discs")
        if self.diameter_mm >= self.spacing_mm:
            raise refuse(
                f"expected a diameter_mm below the spacing_mm of {self.spacing_mm:g}, "
                f"found {self.diameter_mm:g}"
            )
        room = 2 * self.spacing_mm - self.diameter_mm
        corner = self.corner_diameter_mm
        if corner is not None and not self.diameter_mm < corner < room:
            raise refuse(
                f"expected a corner_diameter_mm between the diameter_mm of {self.diameter_mm:g} "
                f"and the {room:g} that leave room for the next disc, found {corner:g}"
            )

    def points(self) -> FloatArray:
        """Return the (rows * columns, 3) centres of the discs, row by row, metres."""
        return lattice.flat_points(self._lattice, self.spacing_mm * MM / 2)

    def drawing(self) -> Drawing:
        """Return the discs on a plate that ends one spacing beyond the outer centres."""
        outline = outline_around(self._discs[:, :2], self.spacing_mm * MM)
        return Drawing(discs=self._discs, outline=outline)

    def turns(self) -> tuple[IntArray, ...]:
        """Return four turns of a square plain plate, two of a rectangular one, else one."""
        if self.corner_diameter_mm is None:
            return lattice.symmetries(self._lattice)
        return super().turns()

    def detect(self, grey: GreyImage) -> Detection:
        """Return the centres of the discs, all but cut ones, or why not all were found.

        Without a larger corner disc, point 0 is the corner nearest to the top left of the image.
        """
        discs = find_discs(grey, self._pattern)
        if isinstance(discs, str):
            return Detection.missing(discs)
        orders = lattice.right_handed(self._lattice, discs.pixels)
        if self.corner_diameter_mm is None:
            order = lattice.first_in_image(discs.pixels, orders)
            return discs.detection(order)
        corner = self._larger_corner(discs.sizes, self.corner_diameter_mm / self.diameter_mm)
        if isinstance(corner, str):
            return Detection.missing(corner)
        for order in orders:
            if order[0] == corner:
                return discs.detection(order)
        return Detection.missing(
            f"the larger disc lies at a corner that is point 0 of {self.rows}x{self.columns} "
            f"discs, not of {self.columns}x{self.rows}: columns and rows are swapped"
        )

    @cached_property
    def _discs(self) -> FloatArray:
        """(rows * columns, 3) centre (x, y) and radius of each disc, metres."""
        radii = np.full(len(self._lattice), 0.5 * self.diameter_mm * MM)
        if self.corner_diameter_mm is not None:
            radii[0] = 0.5 * self.corner_diameter_mm * MM
        return np.column_stack([self.points()[:, :2], radii])

    @property
    def _lattice(self) -> IntArray:
        return lattice.grid(self.columns, self.rows)

    @cached_property
    def _pattern(self) -> Pattern:
        corner = self.corner_diameter_mm or self.diameter_mm
        return Pattern(
            self._lattice,
            self._lattice // 2,
            reach=2.0 * self.spacing_mm / self.diameter_mm,
            larger=corner / self.diameter_mm,
            name=f"{self.columns}x{self.rows}",
        )

    def _larger_corner(self, sizes: FloatArray, expected: float) -> int | str:
        """Return which of the detected points is the larger disc, or why that is not clear."""
        n = self.rows * self.columns
        corners = np.array([0, self.columns - 1, n - self.columns, n - 1])
        ratios = sizes[corners] / np.median(sizes)
        larger = corners[ratios > math.sqrt(expected)]
        if len(larger) == 1:
            return int(larger[0])
        found = ", ".join(f"{ratio:.2f}" for ratio in ratios)
        return (
            f"the larger corner disc cannot be told: expected one {expected:.2f} times as large "
            f"as the others, found {found} at the corners"
        )
