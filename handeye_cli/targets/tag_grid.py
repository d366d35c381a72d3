"""A grid of coded tags, AprilTag or ArUco; any part of it may be seen."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from handeye_cli.conventions import MM
from handeye_cli.records import Camera, FloatArray, GreyImage, IntArray
from handeye_cli.targets import lattice
from handeye_cli.targets.board import Board, Detection
from handeye_cli.targets.drawing import Drawing, outline_around
from handeye_cli.targets.front_view import fits_plane
from handeye_cli.targets.keys import Range
from handeye_cli.targets.markers import (
    UNIT_TAG,
    dictionary_name,
    family_name,
    find_tags,
    is_apriltag,
    none_found,
    require_markers,
    tag_cells,
    upright,
)
from handeye_cli.targets.tag_refinement import TagPrint, refine_tags

_MISFIT = 0.25
"""Tags are refused as this grid when a corner is off by more, in sides of a tag."""


class _TagGrid(Board):
    """Tag t has its corners as points 4 t to 4 t + 3; tag 0 is the top left one, row by row.

    Corners of a tag go top left, top right, bottom right, bottom left; the top left corner of the
    tag in column c and row r lies at x = c * (size + gap), y = r * (size + gap).
    """

    columns: int
    rows: int
    size_mm: float
    gap_mm: float

    def __post_init__(self) -> None:
        require_markers(self._markers, self.columns * self.rows)

    @property
    @abstractmethod
    def _markers(self) -> str:
        """OpenCV's name of the dictionary."""

    @property
    def _positions(self) -> FloatArray:
        """(4 * tags, 2) corners in mm."""
        places = lattice.grid(self.columns, self.rows) / 2 * (self.size_mm + self.gap_mm)
        return np.asarray((places[:, None] + self.size_mm * UNIT_TAG).reshape(-1, 2))

    def points(self) -> FloatArray:
        """Return the (4 * columns * rows, 3) corners of the tags, metres."""
        return lattice.flat_points(self._positions, MM)

    def drawing(self) -> Drawing:
        """Return the tags, each upright, with a margin of a quarter of their side."""
        side, corners = self.size_mm * MM, self.points()[:, :2]
        dark = [
            upright(self._markers, tag, side) + np.tile(corner, 2)
            for tag, corner in enumerate(corners[::4])
        ]
        return Drawing(rectangles=np.concatenate(dark), outline=outline_around(corners, side / 4))

    def detect(self, grey: GreyImage) -> Detection:
        """Return the corners of the seen tags, or why they are none of this grid.

        AprilTags are printed upright or, by OpenCV up to 5.0, upside down each: the way that lies
        flat is taken, for which two tags must be seen.
        """
        found, repeated = find_tags(grey, self._markers)
        tags = {tag: quad for tag, quad in found.items() if tag < self.columns * self.rows}
        if not tags:
            return Detection.missing(none_found(self._markers, repeated))
        if len(tags) == 1 and is_apriltag(self._markers):
            return Detection.missing("1 tag was found: at least 2 are needed")
        numbers = np.array(list(tags), dtype=np.int64)
        ids = (4 * numbers[:, None] + np.arange(4)).ravel()
        corners = np.stack(list(tags.values()))
        for turn in (0, 2) if is_apriltag(self._markers) else (0,):
            pixels = np.roll(corners, turn, axis=1).reshape(-1, 2)
            if self._lies_flat(ids, pixels):
                return Detection(ids, pixels)
        return Detection.missing(
            f"{len(tags)} tags were found, but not where a grid of {self.columns}x{self.rows} with "
            "tag 0 at the top left, row by row, has them"
        )

    def refine(self, grey: GreyImage, seen: Detection, camera: Camera | None) -> Detection:
        """Return the corners where the edges of the black squares meet, with their noise.

        Tags that are covered in part are left out.
        """
        cells = tag_cells(self._markers)
        look = TagPrint(cells, min(1.0, cells * self.gap_mm / self.size_mm))
        return refine_tags(grey, self.points(), look, seen, camera)

    def _lies_flat(self, ids: IntArray, pixels: FloatArray) -> bool:
        return fits_plane(self._positions[ids], pixels, _MISFIT * self.size_mm)


@dataclass(frozen=True)
class AprilTagGrid(_TagGrid):
    """A grid of tags of an AprilTag family.

    Attributes:
        family: Such as `36h11`.
        columns: Tags in a row.
        rows: Rows of tags.
        size_mm: Side of a tag's black square.
        gap_mm: Distance between the black squares of neighbours.
    """

    TYPE: ClassVar[str] = "apriltag-grid"
    SHORTHAND: ClassVar[str] = ":{family}:{columns}x{rows}:{size_mm}:{gap_mm}"
    EXAMPLE: ClassVar[str] = "apriltag-grid:36h11:6x6:55mm:16.5mm"

    family: str
    columns: Annotated[int, Range(1)]
    rows: Annotated[int, Range(1)]
    size_mm: float
    gap_mm: float

    @property
    def _markers(self) -> str:
        return family_name(self.family)


@dataclass(frozen=True)
class ArucoTagGrid(_TagGrid):
    """A grid of tags of an ArUco dictionary.

    Attributes:
        dictionary: OpenCV's name of it.
        columns: Tags in a row.
        rows: Rows of tags.
        size_mm: Side of a tag's black square.
        gap_mm: Distance between the black squares of neighbours.
    """

    TYPE: ClassVar[str] = "aruco-grid"
    SHORTHAND: ClassVar[str] = ":{dictionary}:{columns}x{rows}:{size_mm}:{gap_mm}"
    EXAMPLE: ClassVar[str] = "aruco-grid:DICT_5X5_100:5x7:40mm:8mm"

    dictionary: str
    columns: Annotated[int, Range(1)]
    rows: Annotated[int, Range(1)]
    size_mm: float
    gap_mm: float

    @property
    def _markers(self) -> str:
        return dictionary_name(self.dictionary)
