"""Coded markers through OpenCV: dictionaries by name, and the tags seen in an image."""

from __future__ import annotations

from functools import cache
from typing import Any

import cv2
import numpy as np

from handeye_cli.errors import did_you_mean
from handeye_cli.records import FloatArray, GreyImage
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


def is_apriltag(name: str) -> bool:
    """Say whether a dictionary is an AprilTag family."""
    return name.startswith(_FAMILY)


def find_tags(grey: GreyImage, name: str) -> dict[int, FloatArray]:
    """Return the tags of a dictionary that are seen exactly once.

    Args:
        grey: (height, width) image.
        name: The dictionary's name.

    Returns:
        Tag ids, ascending, and their (4, 2) corners in pixels: top left, top right, bottom right
        and bottom left of the upright tag. An AprilTag is upright as its authors publish it.
    """
    settings = cv2.aruco.DetectorParameters()
    # CORNER_REFINE_APRILTAG is half a pixel off
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(dictionary(name), settings)
    quads, ids, _ = detector.detectMarkers(grey)
    if ids is None or len(ids) == 0:
        return {}
    corners = np.reshape(quads, (-1, 4, 2)).astype(np.float64)
    if is_apriltag(name) and _apriltags_upside_down():
        corners = np.roll(corners, 2, axis=1)
    found, where, times = np.unique(ids, return_index=True, return_counts=True)
    return {int(i): corners[k] for i, k, n in zip(found, where, times, strict=True) if n == 1}


@cache
def _apriltags_upside_down() -> bool:
    """Say whether this OpenCV holds the AprilTags turned by 180 degrees, as up to 5.0 they are."""
    tag = cv2.aruco.generateImageMarker(dictionary("DICT_APRILTAG_36h11"), 0, 8)
    upright = [bit == "1" for bit in f"{_TAG36H11_0:036b}"]
    return not np.array_equal(tag[1:-1, 1:-1].ravel() > 0, upright)
