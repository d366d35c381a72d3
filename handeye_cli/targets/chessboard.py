"""A chessboard, nearly all of whose inner corners must be seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from handeye_cli.conventions import MM
from handeye_cli.records import Camera, FloatArray, GreyImage, IntArray
from handeye_cli.targets import lattice
from handeye_cli.targets.board import Board, Detection
from handeye_cli.targets.chessboard_finder import find_chessboard
from handeye_cli.targets.corner_refinement import refine_corners
from handeye_cli.targets.drawing import Drawing, checkers, outline_around
from handeye_cli.targets.front_view import fits_plane, front_view
from handeye_cli.targets.keys import Range, require_few


@dataclass(frozen=True)
class Chessboard(Board):
    """Inner corners at x = column * square, y = row * square; the top left square is dark.

    The colours tell a half turn when columns + rows is odd, and a quarter turn of a square board
    when its number of columns is odd.

    Attributes:
        columns: Inner corners in a row.
        rows: Rows of inner corners.
        square_mm: Side of a square.
    """

    TYPE: ClassVar[str] = "chessboard"
    SHORTHAND: ClassVar[str] = ":{columns}x{rows}:{square_mm}"
    EXAMPLE: ClassVar[str] = "chessboard:9x6:23.6mm"

    columns: Annotated[int, Range(3)]
    rows: Annotated[int, Range(3)]
    square_mm: float

    def __post_init__(self) -> None:
        require_few(self.columns, self.rows, "corners")

    def points(self) -> FloatArray:
        """Return the (rows * columns, 3) inner corners, row by row, metres."""
        return lattice.flat_points(self._lattice, self.square_mm * MM / 2)

    def drawing(self) -> Drawing:
        """Return the dark squares on a plate with a margin as wide as a square."""
        side = self.square_mm * MM
        dark = checkers(self.columns + 1, self.rows + 1, side) - side
        return Drawing(rectangles=dark, outline=outline_around(dark, side))

    def turns(self) -> tuple[IntArray, ...]:
        """Return the turns that bring dark squares onto dark squares."""
        squares = lattice.grid(self.columns + 1, self.rows + 1) - 1
        return lattice.symmetries(self._lattice, squares[_dark(squares)])

    def detect(self, grey: GreyImage) -> Detection:
        """Return the inner corners, all but a few covered ones, or why they were not found.

        Where the colours leave a choice, point 0 is the corner nearest to the image's top left.
        """
        found = find_chessboard(grey, self.columns, self.rows)
        if isinstance(found, str):
            return Detection.missing(found)
        if not fits_plane(self._lattice, found.pixels, 0.5):
            return Detection.missing("the corners that were found do not lie on a chessboard")
        orders = [
            order
            for order in lattice.right_handed(self._lattice, found.pixels)
            if self._colours_agree(grey, found.pixels[order])
        ]
        if not orders:
            return Detection.missing(
                f"a board with {self.columns}x{self.rows} inner corners was found, but in no "
                "order of them is the square at the top left dark"
            )
        order = lattice.first_in_image(found.pixels, orders)
        ids = np.flatnonzero(found.seen[order]).astype(np.int64)
        return Detection(ids, found.pixels[order[ids]])

    def refine(self, grey: GreyImage, seen: Detection, camera: Camera | None) -> Detection:
        """Return the corners where the edges cross, with the noise that the image leaves."""
        return refine_corners(grey, self.points()[:, :2], self.square_mm * MM, seen, camera)

    @property
    def _lattice(self) -> IntArray:
        return lattice.grid(self.columns, self.rows)

    def _colours_agree(self, grey: GreyImage, pixels: FloatArray) -> bool:
        """Say whether the squares between the corners are dark where they should be."""
        squares = lattice.grid(self.columns - 1, self.rows - 1) + 1
        view = front_view(grey, self._lattice, pixels)
        levels = view.image[view.places(squares)].astype(np.float64)
        dark = _dark(squares)
        return bool(levels[dark].mean() < levels[~dark].mean())


def _dark(squares: IntArray) -> IntArray:
    """Return which of the squares with these (n, 2) centres, in half squares, are dark."""
    return np.asarray((squares + 1).sum(axis=1) % 4 == 0)
