"""Coded markers through OpenCV: dictionaries by name, and the tags seen in an image."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye_cli.errors import did_you_mean
from handeye_cli.records import FloatArray, GreyImage, IntArray
from handeye_cli.targets.drawing import dark_cells
from handeye_cli.targets.keys import refuse

UNIT_TAG = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
"""Corners of a tag of size 1: top left, top right, bottom right, bottom left."""

_FAMILY = "DICT_APRILTAG_"
_TAG36H11_0 = 0xD5D628584
"""Tag 0 of the family 36h11: its 36 squares row by row from the top left, white being 1."""


def dictionary_name(name: str, key: str = "dictionary") -> str:
    """Return OpenCV's name of a dictionary, which may be given in any case.

    Raises:
        InputError: There is no such dictionary.
    """
    known = {each.upper(): each for each in sorted(dir(cv2.aruco)) if each.startswith("DICT_")}
    found = known.get(name.upper())
    if found is None:
        near = did_you_mean(name.upper(), list(known))
        hint = f"did you mean {known[near]!r}?" if near else "such as DICT_6X6_250"
        raise refuse(f"expected the name of a {key}, found {name!r}", hint)
    return found


def family_name(name: str) -> str:
    """Return OpenCV's name of an AprilTag family: `36h11`, `tag36h11` or `DICT_APRILTAG_36h11`.

    Raises:
        InputError: There is no such family.
    """
    word = name.upper().removeprefix(_FAMILY).removeprefix("TAG")
    families = sorted(
        {each.removeprefix(_FAMILY).lower() for each in dir(cv2.aruco) if each.startswith(_FAMILY)}
    )
    if word.lower() not in families:
        near = did_you_mean(word.lower(), families)
        hint = f"did you mean {near!r}?" if near else None
        raise refuse(f"expected one of the families {', '.join(families)}, found {name!r}", hint)
    return dictionary_name(_FAMILY + word)


def dictionary(name: str) -> Any:
    """Return OpenCV's dictionary of a name that `dictionary_name` or `family_name` gave."""
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


def require_markers(name: str, needed: int) -> None:
    """Check that a dictionary has enough markers.

    Raises:
        InputError: It has fewer than `needed`.
    """
    size = len(dictionary(name).bytesList)
    if needed > size:
        raise refuse(f"expected a dictionary of at least {needed} markers, found {name} of {size}")


def tag_cells(name: str) -> int:
    """Return how many cells are in a row of a dictionary's markers, the black border included."""
    return int(dictionary(name).markerSize) + 2


def printed(name: str, number: int, side: float) -> FloatArray:
    """Return the dark cells of a marker as OpenCV prints it.

    Args:
        name: The dictionary's name.
        number: Of the marker.
        side: Of the black square.

    Returns:
        (m, 4) rectangles x0, y0, x1, y1 from the top left corner, in the unit of the side.
    """
    cells = _cells(name, number)
    return dark_cells(cells, side / len(cells))


def upright(name: str, number: int, side: float) -> FloatArray:
    """Return the dark cells of a marker as `printed` does, an AprilTag as its authors print it."""
    turned = is_apriltag(name) and _apriltags_upside_down()
    cells = _cells(name, number)
    return dark_cells(cells[::-1, ::-1] if turned else cells, side / len(cells))


def _cells(name: str, number: int) -> NDArray[np.bool_]:
    """Return which cells of a marker are dark, its border included."""
    known = dictionary(name)
    return np.asarray(cv2.aruco.generateImageMarker(known, number, tag_cells(name)) < 128)


def is_apriltag(name: str) -> bool:
    """Say whether a dictionary is an AprilTag family."""
    return name.startswith(_FAMILY)


class Tags(NamedTuple):
    """The tags of a dictionary in an image.

    Attributes:
        once: Ids, ascending, of those that are seen exactly once, and their (4, 2) corners in
            pixels: top left, top right, bottom right and bottom left of the upright tag, good to a
            pixel or two. An AprilTag is upright as its authors publish it.
        repeated: Ids of those that are seen more often, which leaves open where they are.
    """

    once: dict[int, FloatArray]
    repeated: tuple[int, ...]


def find_tags(grey: GreyImage, name: str) -> Tags:
    """Return the tags of a dictionary that are seen.

    Args:
        grey: (height, width) image.
        name: The dictionary's name.
    """
    ids, quads = _detected(grey, name)
    if is_apriltag(name) and _apriltags_upside_down():
        quads = np.roll(quads, 2, axis=1)
    found, where, times = np.unique(ids, return_index=True, return_counts=True)
    return Tags(
        {int(i): quads[k] for i, k, n in zip(found, where, times, strict=True) if n == 1},
        tuple(found[times > 1].tolist()),
    )


def none_found(name: str, repeated: Sequence[int]) -> str:
    """Return that there is no tag of a dictionary, but for those that are seen several times."""
    if not repeated:
        return f"no tag of {name} was found"
    listed = ", ".join(map(str, repeated))
    return f"no tag of {name} was found just once, but several with the ids {listed}"


def _detected(grey: GreyImage, name: str) -> tuple[IntArray, FloatArray]:
    """Return the (n,) ids and (n, 4, 2) corners of all tags, as OpenCV orders them."""
    settings = cv2.aruco.DetectorParameters()
    # The edges are fitted later: windows for corners reach into the code, or into the next tag.
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
    quads, ids, _ = cv2.aruco.ArucoDetector(dictionary(name), settings).detectMarkers(grey)
    found = np.zeros(0) if ids is None else np.ravel(ids)
    return found.astype(np.int64), np.reshape(quads, (-1, 4, 2)).astype(np.float64)


@cache
def _apriltags_upside_down() -> bool:
    """Say whether this OpenCV begins at an AprilTag's bottom right corner, as up to 5.0 it does."""
    bits = [255 * (bit == "1") for bit in f"{_TAG36H11_0:036b}"]
    tag = np.pad(np.array(bits, dtype=np.uint8).reshape(6, 6), 1)
    picture = np.pad(np.kron(tag, np.ones((8, 8), dtype=np.uint8)), 16, constant_values=255)
    _, quads = _detected(picture, _FAMILY + "36h11")
    return bool(quads[0, 0, 0] > quads[0, 2, 0])
