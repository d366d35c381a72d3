"""Where a target leaves the image, for people who want to know why it was not found."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from handeye_cli.records import FloatArray

SIDES = ("left", "top", "right", "bottom")


class Leaving(NamedTuple):
    """What of a target is not in the image.

    Attributes:
        outside: Number of points, or discs, of the target.
        sides: Sides of the image beyond which they lie, in the order of `SIDES`.
    """

    outside: int
    sides: list[str]


def leaving(boxes: FloatArray, size: tuple[int, ...], margin: float = 0.0) -> Leaving:
    """Return how much of a target lies beyond which sides of an image.

    Args:
        boxes: (n, 2, 2) least and largest x and y of each point or disc, pixels.
        size: Height and width of the image.
        margin: Pixels from the image's edge within which a point counts as outside.
    """
    last = np.array(size[::-1]) - 1.0
    beyond = np.hstack([boxes[:, 0] < margin, boxes[:, 1] > last - margin])
    sides = [SIDES[k] for k in np.flatnonzero(beyond.any(axis=0)).tolist()]
    return Leaving(int(np.count_nonzero(beyond.any(axis=1))), sides)


def named(sides: Sequence[str]) -> str:
    """Return the words for one side or more, such as `on the left and top`."""
    if len(sides) == len(SIDES):
        return "on all sides"
    *most, last = sides
    return f"on the {', '.join(most)} and {last}" if most else f"on the {last}"
