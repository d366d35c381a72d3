"""A chessboard, all of whose inner corners must be seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import cv2
import numpy as np

from handeye_cli.conventions import MM
from handeye_cli.records import FloatArray, GreyImage, IntArray
from handeye_cli.targets import lattice
from handeye_cli.targets.board import Board, Detection
from handeye_cli.targets.drawing import Drawing, checkers, outline_around
from handeye_cli.targets.front_view import fits_plane, front_view
from handeye_cli.targets.keys import Range

_REACH = 0.35
"""Half of the refinement's window in corner spacings: at 0.5 it would see the next corner."""


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
        """Return all inner corners, or why they were not found.

        Where the colours leave a choice, point 0 is the corner nearest to the image's top left.
        """
        corners = self._find(grey)
        if corners is None:
            return Detection.missing(
                f"no chessboard of {self.columns}x{self.rows} inner corners was found"
            )
        pixels = _refined(grey, corners.reshape(self.rows, self.columns, 2))
        if not fits_plane(self._lattice, pixels, 0.5):
            return Detection.missing("the corners that were found do not lie on a chessboard")
        orders = [
            order
            for order in lattice.right_handed(self._lattice, pixels)
            if self._colours_agree(grey, pixels[order])
        ]
        if not orders:
            return Detection.missing(
                f"a board with {self.columns}x{self.rows} inner corners was found, but in no "
                "order of them is the square at the top left dark"
            )
        return Detection.whole(pixels[lattice.first_in_image(pixels, orders)])

    @property
    def _lattice(self) -> IntArray:
        return lattice.grid(self.columns, self.rows)

    def _find(self, grey: GreyImage) -> FloatArray | None:
        size = (self.columns, self.rows)
        flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
        found, corners = cv2.findChessboardCorners(
            grey, size, flags=flags | cv2.CALIB_CB_FAST_CHECK
        )
        if not found:
            found, corners = cv2.findChessboardCornersSB(grey, size)
        return np.asarray(corners, dtype=np.float64) if found else None

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


def _refined(grey: GreyImage, corners: FloatArray) -> FloatArray:
    """Return (rows, columns, 2) corners as (n, 2) pixels moved to the saddle of the grey levels."""
    across = np.linalg.norm(np.diff(corners, axis=1), axis=-1).min()
    along = np.linalg.norm(np.diff(corners, axis=0), axis=-1).min()
    half = max(2, int(_REACH * min(across, along)))
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-3)
    start = corners.reshape(-1, 1, 2).astype(np.float32)
    pixels = cv2.cornerSubPix(grey, start, (half, half), (-1, -1), criteria)
    return np.reshape(pixels, (-1, 2)).astype(np.float64)
