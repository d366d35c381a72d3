"""Ways to seek discs in an image: reduced or enlarged, through windows of several widths.

Most plates are found at the first step, in an image of moderate size as it is. The others are for
smaller discs, light ones, noise, and narrow gaps that are open only in an enlarged image.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np

from handeye_cli.records import GreyImage
from handeye_cli.targets.disc_spots import Spots, find_spots

_SIDE = 800
"""Pixels of the longer side of the image the discs are sought in first, at most."""
_ENLARGED = 1600
"""The same of an image that is also looked at enlarged."""
_MEDIUM, _SMALL, _LARGE, _NARROW = (45, 0.2), (23, 0.4), (161, 0.0), (31, 0.5)
"""Ways to tell dark from light: window, pixels, and depth."""


class Step(NamedTuple):
    """A way to seek discs.

    Attributes:
        factor: Pixels of the image along a pixel of that in which discs are sought.
        window: See `find_spots`.
        depth: See `find_spots`.
        smooth: Whether noise is smoothed out first.
        light: Whether light discs are sought instead of dark ones.
    """

    factor: float
    window: int
    depth: float
    smooth: bool
    light: bool


@lru_cache
def ladder(size: tuple[int, ...]) -> tuple[Step, ...]:
    """Return the ways to seek discs in an image of some size, the likely and quick ones first.

    An image at its full size is looked at late and enlarged last, and serves small discs only.

    Args:
        size: Height and width.
    """
    coarse = max(1, min(-(-max(size) // _SIDE), *size))
    fine = -(-coarse // 2)
    likely = [(coarse, *_MEDIUM), (fine, *_SMALL)]
    noisy = [(coarse, *_LARGE), (coarse, *_MEDIUM), (1, *_SMALL)]
    narrow = [(0.5, *_NARROW)] if max(size) <= _ENLARGED else []
    steps = [
        Step(factor, window, depth, ways is noisy, light)
        for ways in (likely, noisy, narrow)
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


def enlarged(grey: GreyImage) -> GreyImage:
    """Return an image twice as high and wide, in which narrow gaps between discs are open."""
    twice = cv2.resize(grey, None, fx=2.0, fy=2.0, interpolation=cv2.INTER_CUBIC)
    return np.asarray(twice, dtype=np.uint8)


def reduced(grey: GreyImage, factor: int) -> GreyImage:
    """Return an image whose pixels are the means of factor x factor pixels."""
    rows, columns = (size // factor for size in grey.shape)
    image = grey[: rows * factor, : columns * factor]
    # halving has a fast path of its own
    while factor % 2 == 0:
        factor //= 2
        size = (columns * factor, rows * factor)
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    if factor > 1:
        small = cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA)
        return np.asarray(small, dtype=np.uint8)
    return image
