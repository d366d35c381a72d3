"""Rows of discs of which every second one is shifted by half a distance."""

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
class AsymmetricCircles(DiscBoard):
    """Discs at x = (2 * column + row % 2) * spacing, y = row * spacing.

    So `spacing_mm` is the distance between rows, half of the distance between neighbours in a row,
    as in OpenCV's pattern. With an odd number of rows no turn brings the pattern onto itself; with
    an even number a half turn does.

    Attributes:
        rows: Rows of discs.
        columns: Discs in a row.
        spacing_mm: Distance between neighbouring rows.
        diameter_mm: Of a disc.
    """

    TYPE: ClassVar[str] = "asymmetric-circles"
    SHORTHAND: ClassVar[str] = ":{columns}x{rows}:{spacing_mm}:{diameter_mm}"
    EXAMPLE: ClassVar[str] = "asymmetric-circles:4x11:20mm:10mm"

    rows: Annotated[int, Range(3)]
    columns: Annotated[int, Range(2)]
    spacing_mm: float
    diameter_mm: float

    def __post_init__(self) -> None:
        require_few(self.columns, self.rows, "discs")
        nearest = math.sqrt(2) * self.spacing_mm
        if self.diameter_mm >= nearest:
            raise refuse(
                f"expected a diameter_mm below {nearest:.6g}, the distance of the nearest discs "
                f"at a spacing_mm of {self.spacing_mm:g}, found {self.diameter_mm:g}"
            )

    def points(self) -> FloatArray:
        """Return the (rows * columns, 3) centres of the discs, row by row, metres."""
        return lattice.flat_points(self._lattice, self.spacing_mm * MM / 2)

    def drawing(self) -> Drawing:
        """Return the discs on a plate that ends two spacings beyond the outer centres."""
        outline = outline_around(self._discs[:, :2], 2 * self.spacing_mm * MM)
        return Drawing(discs=self._discs, outline=outline)

    def turns(self) -> tuple[IntArray, ...]:
        """Return one turn with an odd number of rows, two with an even one."""
        return lattice.symmetries(self._lattice)

    def detect(self, grey: GreyImage) -> Detection:
        """Return the centres of the discs, all but cut ones, or why not all were found."""
        layout = self._lattice
        discs = find_discs(grey, self._pattern)
        if isinstance(discs, str):
            return Detection.missing(discs)
        orders = lattice.right_handed(layout, discs.pixels)
        if not orders:
            return Detection.missing("the discs were found mirrored, as if seen from behind")
        return discs.detection(lattice.first_in_image(discs.pixels, orders))

    @cached_property
    def _discs(self) -> FloatArray:
        """(rows * columns, 3) centre (x, y) and radius of each disc, metres."""
        radii = np.full(len(self._lattice), 0.5 * self.diameter_mm * MM)
        return np.column_stack([self.points()[:, :2], radii])

    @cached_property
    def _pattern(self) -> Pattern:
        x, y = self._lattice.T // 2
        # nearest neighbours are along the diagonals
        return Pattern(
            self._lattice,
            np.stack([x + y, y - x], axis=1) // 2,
            reach=2.0 * math.sqrt(2.0) * self.spacing_mm / self.diameter_mm,
            larger=1.0,
            name=f"{self.columns}x{self.rows}",
        )

    @cached_property
    def _lattice(self) -> IntArray:
        row, column = np.divmod(np.arange(self.rows * self.columns), self.columns)
        return 2 * np.stack([2 * column + row % 2, row], axis=1)
