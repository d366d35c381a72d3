"""A ChArUco board: a chessboard with markers in its light squares; any part of it may be seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar

import cv2
import numpy as np

from handeye_cli.conventions import MM
from handeye_cli.records import Camera, Finding, FloatArray, GreyImage, IntArray
from handeye_cli.targets import lattice
from handeye_cli.targets.board import Board, Detection
from handeye_cli.targets.corner_refinement import refine_corners, spans_a_plane
from handeye_cli.targets.drawing import Drawing, checkers, outline_around
from handeye_cli.targets.keys import Range, refuse
from handeye_cli.targets.markers import (
    dictionary,
    dictionary_name,
    printed,
    require_markers,
)

_NOTES = {
    False: "layout of OpenCV 4.6 and later",
    True: "layout of OpenCV before 4.6 (legacy)",
}
"""The layouts by the value of `legacy`."""


@dataclass(frozen=True)
class Charuco(Board):
    """Inner corners at x = column * square, y = row * square, from the first inner corner on.

    The ids are OpenCV's; its own frame begins one square up and left, at the board's outer corner.

    Attributes:
        columns: Squares in a row.
        rows: Rows of squares.
        square_mm: Side of a square.
        marker_mm: Side of a marker.
        dictionary: OpenCV's name of the markers' dictionary.
        legacy: Whether the board was made by OpenCV before 4.6; with an even number of rows that
            is another layout, and None tries both.
    """

    TYPE: ClassVar[str] = "charuco"
    SHORTHAND: ClassVar[str] = ":{columns}x{rows}:{square_mm}:{marker_mm}:{dictionary}[:{legacy}]"
    EXAMPLE: ClassVar[str] = "charuco:5x7:36.195mm:18.256mm:DICT_6X6_250"

    columns: Annotated[int, Range(3)]
    rows: Annotated[int, Range(3)]
    square_mm: float
    marker_mm: float
    dictionary: str
    legacy: bool | None = None

    def __post_init__(self) -> None:
        if self.marker_mm >= self.square_mm:
            raise refuse(
                f"expected a marker_mm below the square_mm of {self.square_mm:g}, "
                f"found {self.marker_mm:g}"
            )
        require_markers(dictionary_name(self.dictionary), self.columns * self.rows // 2)

    def points(self) -> FloatArray:
        """Return the ((rows - 1) * (columns - 1), 3) inner corners, row by row, metres."""
        return lattice.flat_points(self._lattice, self.square_mm * MM / 2)

    def drawing(self) -> Drawing:
        """Return the board as OpenCV prints it, with a margin as wide as a square.

        Where `legacy` is not given, it is the layout of OpenCV 4.6 and later.
        """
        side, marker = self.square_mm * MM, self.marker_mm * MM
        dark_first = not self.legacy or self.rows % 2 == 1
        row, column = np.divmod(np.arange(self.columns * self.rows), self.columns)
        light = (row + column) % 2 == dark_first
        corners = np.stack([column, row], axis=1)[light] * side - (side + marker) / 2
        name = dictionary_name(self.dictionary)
        codes = [printed(name, k, marker) + np.tile(at, 2) for k, at in enumerate(corners)]
        board = checkers(self.columns, self.rows, side, dark_first=dark_first) - side
        return Drawing(
            rectangles=np.concatenate([board, *codes]), outline=outline_around(board, side)
        )

    def detect(self, grey: GreyImage) -> Detection:
        """Return the corners that are seen, or why they are too few.

        Where the layout is open, the note says which one fits better.
        """
        looks = [self._corners(grey, legacy) for legacy in self._layouts]
        best, markers = max(looks, key=lambda look: len(look[0].ids))
        if markers == 0:
            name = dictionary_name(self.dictionary)
            return Detection.missing(f"no marker of {name} was found")
        if not spans_a_plane(self.points()[best.ids, :2]):
            return Detection.missing(
                f"{len(best.ids)} of {len(self._lattice)} corners were found: at least 4 that are "
                "not all on one line are needed"
            )
        return best

    def refine(self, grey: GreyImage, seen: Detection, camera: Camera | None) -> Detection:
        """Return the corners where the edges cross, with the noise that the image leaves."""
        corners, square = self.points()[:, :2], self.square_mm * MM
        gap = (self.square_mm - self.marker_mm) / 2.0 * MM
        return refine_corners(grey, corners, square, seen, camera, gap=gap)

    def settled(self, seen: Sequence[Detection]) -> tuple[Board, Finding | None]:
        """Return the board with the layout that the images show, and a finding if it was open."""
        corners = {
            legacy: sum(len(each.ids) for each in seen if each.note == _NOTES[legacy])
            for legacy in self._layouts
        }
        if len(corners) == 1 or not any(corners.values()):
            return self, None
        legacy = corners[True] > corners[False]
        images = sum(each.note == _NOTES[legacy] for each in seen)
        shown = sum(each.note is not None for each in seen)
        value = str(legacy).lower()
        finding = Finding(
            "charuco-layout",
            "info",
            f"with {self.rows} rows of squares the board has one of two layouts; {images} of "
            f"{shown} images that show it have the {_NOTES[legacy]}",
            f"add legacy: {value} to the target, or :legacy={value} to its shorthand, to fix it",
        )
        return replace(self, legacy=legacy), finding

    @property
    def _lattice(self) -> IntArray:
        return lattice.grid(self.columns - 1, self.rows - 1)

    @property
    def _layouts(self) -> tuple[bool, ...]:
        """Values of `legacy` that the description leaves open."""
        both = self.legacy is None and self.rows % 2 == 0
        return (False, True) if both else (bool(self.legacy),)

    def _corners(self, grey: GreyImage, legacy: bool) -> tuple[Detection, int]:
        """Return the seen corners of one layout, and the number of markers."""
        corners, ids, _, markers = self._detector(legacy).detectBoard(grey)
        found = np.zeros(0, dtype=np.int64) if ids is None else np.ravel(ids).astype(np.int64)
        order = np.argsort(found)
        pixels = np.zeros((0, 2)) if ids is None else np.reshape(corners, (-1, 2))
        note = _NOTES[legacy] if len(self._layouts) > 1 else None
        seen = Detection(found[order], pixels[order].astype(np.float64), note=note)
        return seen, 0 if markers is None else len(markers)

    def _detector(self, legacy: bool) -> Any:
        board = cv2.aruco.CharucoBoard(
            (self.columns, self.rows),
            float(self.square_mm),
            float(self.marker_mm),
            dictionary(dictionary_name(self.dictionary)),
        )
        board.setLegacyPattern(legacy)
        settings = cv2.aruco.CharucoParameters()
        # one marker beside a corner is enough: the default of two loses the corners at the rim
        settings.minMarkers = 1
        settings.tryRefineMarkers = True
        return cv2.aruco.CharucoDetector(board, settings)
