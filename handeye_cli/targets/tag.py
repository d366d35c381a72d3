"""One coded tag, AprilTag or ArUco."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from handeye_cli.conventions import MM
from handeye_cli.records import Camera, FloatArray, GreyImage
from handeye_cli.targets import lattice
from handeye_cli.targets.board import Board, Detection
from handeye_cli.targets.drawing import Drawing, outline_around
from handeye_cli.targets.markers import (
    UNIT_TAG,
    dictionary_name,
    family_name,
    find_tags,
    none_found,
    require_markers,
    tag_cells,
    upright,
)
from handeye_cli.targets.tag_refinement import TagPrint, refine_tags


class _Tag(Board):
    """Points 0 to 3 are the top left, top right, bottom right and bottom left corner.

    The origin is the top left corner of the black square, as the first point of any grid.
    """

    size_mm: float
    id: int | None

    def __post_init__(self) -> None:
        require_markers(self._markers, 1 if self.id is None else self.id + 1)

    @property
    @abstractmethod
    def _markers(self) -> str:
        """OpenCV's name of the dictionary."""

    def points(self) -> FloatArray:
        """Return the (4, 3) corners of the black square, metres."""
        return lattice.flat_points(UNIT_TAG, self.size_mm * MM)

    def drawing(self) -> Drawing:
        """Return the tag, tag 0 if none is named, with a margin of a quarter of its side."""
        side = self.size_mm * MM
        outline = outline_around(self.points()[:, :2], side / 4)
        return Drawing(rectangles=upright(self._markers, self.id or 0, side), outline=outline)

    def detect(self, grey: GreyImage) -> Detection:
        """Return the tag's corners, or why it was not found."""
        tags, repeated = find_tags(grey, self._markers)
        if self.id in repeated:
            return Detection.missing(f"tag {self.id} was found several times: one must be seen")
        listed = ", ".join(str(each) for each in tags)
        if not tags:
            return Detection.missing(none_found(self._markers, repeated))
        if self.id is None and len(tags) > 1:
            return Detection.missing(f"several tags were found, with the ids {listed}: name one")
        wanted = next(iter(tags)) if self.id is None else self.id
        if wanted not in tags:
            return Detection.missing(f"tag {wanted} was not found, but those with the ids {listed}")
        return Detection.whole(tags[wanted])

    def refine(self, grey: GreyImage, seen: Detection, camera: Camera | None) -> Detection:
        """Return the corners where the edges of the black square meet, with their noise."""
        look = TagPrint(tag_cells(self._markers))
        return refine_tags(grey, self.points(), look, seen, camera)


@dataclass(frozen=True)
class AprilTag(_Tag):
    """One tag of an AprilTag family.

    Attributes:
        family: Such as `36h11`.
        size_mm: Side of the black square.
        id: Of the tag, or None for the only one in the image.
    """

    TYPE: ClassVar[str] = "apriltag"
    SHORTHAND: ClassVar[str] = ":{family}:{size_mm}[:id={id}]"
    EXAMPLE: ClassVar[str] = "apriltag:36h11:48mm"

    family: str
    size_mm: float
    id: int | None = None

    @property
    def _markers(self) -> str:
        return family_name(self.family)


@dataclass(frozen=True)
class ArucoTag(_Tag):
    """One tag of an ArUco dictionary.

    Attributes:
        dictionary: OpenCV's name of it.
        size_mm: Side of the black square.
        id: Of the tag, or None for the only one in the image.
    """

    TYPE: ClassVar[str] = "aruco"
    SHORTHAND: ClassVar[str] = ":{dictionary}:{size_mm}[:id={id}]"
    EXAMPLE: ClassVar[str] = "aruco:DICT_5X5_100:40mm"

    dictionary: str
    size_mm: float
    id: int | None = None

    @property
    def _markers(self) -> str:
        return dictionary_name(self.dictionary)
