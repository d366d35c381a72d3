"""Ways to seek discs in an image: reduced or enlarged, through windows of several widths.

Most plates are found at the first step, in an image of moderate size as it is. The others are for
smaller discs, light ones, noise, and narrow gaps that are open only in an enlarged image. The last
ones are for slim discs beside dark surroundings: there the light around, and how far a disc is
below it, are those of the surroundings unless the window is little wider than a disc and the depth
is small. In clutter they see hundreds of spots, which tell nothing of a plate that is not found.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np

from handeye_cli.records import GreyImage
from handeye_cli.targets.disc_spots import Spots, find_spots
from handeye_cli.targets.resampling import enlarged, reduced

_SIDE = 800
"""Pixels of the longer side of the image the discs are sought in first, at most."""
_ENLARGED = 1600
"""The same of an image that is also looked at enlarged."""
_MEDIUM, _SMALL, _LARGE, _NARROW = (45, 0.2), (23, 0.4), (161, 0.0), (31, 0.5)
"""Ways to tell dark from light: window, pixels, and depth."""
_LONG, _SHORT, _SHORTEST = (31, 0.1), (15, 0.3), (11, 0.1)
"""The same for slim discs, the first as the image is and the others in an enlarged image."""


class Step(NamedTuple):
    """A way to seek discs.

    Attributes:
        factor: Pixels of the image along a pixel of that in which discs are sought.
        window: See `find_spots`.
        depth: See `find_spots`.
        smooth: Whether noise is smoothed out first.
        light: Whether light discs are sought instead of dark ones.
        telling: Whether spots without a grid among them may be the plate's.
    """

    factor: float
    window: int
    depth: float
    smooth: bool
    light: bool
    telling: bool = True


@lru_cache
def ladder(size: tuple[int, ...]) -> tuple[Step, ...]:
    """Return the ways to seek discs in an image of some size, the likely and quick ones first.

    An image at its full size is looked at late, and enlarged later, and serves small discs only.

    Args:
        size: Height and width.
    """
    coarse = max(1, min(-(-max(size) // _SIDE), *size))
    fine = -(-coarse // 2)
    enlarging = max(size) <= _ENLARGED
    likely = [(coarse, *_MEDIUM), (fine, *_SMALL)]
    noisy = [(coarse, *_LARGE), (coarse, *_MEDIUM), (1, *_SMALL)]
    narrow = [(0.5, *_NARROW)] if enlarging else []
    slim = [(1, *_LONG), *([(0.5, *_SHORT), (0.5, *_SHORTEST)] if enlarging else [])]
    steps = [
        Step(factor, window, depth, ways is noisy, light, telling=ways is not slim)
        for ways in (likely, noisy, narrow, slim)
        for light in (False, True)
        for factor, window, depth in ways
    ]
    return tuple(dict.fromkeys(steps))


def spots_of(grey: GreyImage, step: Step) -> Spots:
    """Return the spots of an image, in its pixels, that a step finds.

    Args:
        grey: (height, width) image.
        step: What is sought, and how.
    """
    image = enlarged(grey) if step.factor < 1 else reduced(grey, int(step.factor))
    if step.smooth:
        image = np.asarray(cv2.GaussianBlur(image, (3, 3), 0), dtype=np.uint8)
    image = 255 - image if step.light else image
    times = 1.0 / min(step.factor, 1.0)
    return find_spots(image, step.window, step.depth, enlarged=times).scaled(step.factor)
