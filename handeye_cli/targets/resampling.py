"""Images at other sizes, for a search that wants its target some pixels wide."""

from __future__ import annotations

import cv2
import numpy as np

from handeye_cli.records import GreyImage


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
