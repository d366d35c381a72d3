"""The bare paper between the discs of a grid, which shows how the light goes over the plate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry.camera import PlateToPixel
from handeye_cli.geometry.disc_pixels import FloatArray
from handeye_cli.geometry.light_slopes import typical
from handeye_cli.geometry.sensor_limits import BLACK, WHITE, IntArray

_DIAGONAL = (1.2, 1.6)
"""Distances of diagonal neighbours in those of the nearest ones: their middles are bare."""
_WIDEST = 5
"""Pixels that a patch of paper reaches to each side, at most."""


@dataclass(frozen=True)
class Patchwork:
    """Square patches of paper, all of one size.

    Attributes:
        places: (m, 2) middles, pixels.
        level: (m,) mean grey levels.
        count: Pixels of a patch.
    """

    places: FloatArray
    level: FloatArray
    count: int


def paper_between(
    image: NDArray[np.uint8], discs: FloatArray, to_pixel: PlateToPixel, scale: float, clear: float
) -> Patchwork:
    """Look at the paper in the middle of each four discs.

    Args:
        image: (height, width) grey image.
        discs: (n, 3) centre (x, y) on the plate and radius of each disc, metres.
        to_pixel: Map of (..., 2) plate points to (..., 2) pixels.
        scale: Least pixels of a metre on the plate, in any direction.
        clear: How far from the edges of the discs paper is bare, pixels.

    Returns:
        The patches that are nowhere black or white, none where the discs leave no room.
    """
    middles, room = _middles(np.ascontiguousarray(discs).tobytes())
    places = to_pixel(middles)
    free = (room * scale - clear) / math.sqrt(2.0)
    reach = min(math.floor(free), _WIDEST) if len(middles) else -1
    if reach < 0:
        return Patchwork(np.zeros((0, 2)), np.zeros(0), 1)
    u, v = _patch(reach)
    at = np.rint(places).astype(np.int64)
    low, high = at.min(axis=0) - reach, at.max(axis=0) + reach
    if low.min() < 0 or high[0] >= image.shape[1] or high[1] >= image.shape[0]:
        return Patchwork(np.zeros((0, 2)), np.zeros(0), 1)
    grey = image[at[:, 1:] + v, at[:, :1] + u]
    told = (grey.min(axis=1) > BLACK) & (grey.max(axis=1) < WHITE)
    level = np.sum(grey[told], axis=1, dtype=float) / len(u)
    return Patchwork(at[told].astype(float), level, len(u))


@lru_cache(maxsize=_WIDEST + 1)
def _patch(reach: int) -> tuple[IntArray, IntArray]:
    """Return the (k,) columns and rows of a patch's pixels, from its middle."""
    v, u = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    return u.ravel(), v.ravel()


@lru_cache(maxsize=64)
def _middles(plate: bytes) -> tuple[FloatArray, float]:
    """Return the (m, 2) middles between diagonal neighbours, each once, and the room around them.

    All images of a plate ask for them. The room is the distance to the nearest disc's edge.
    """
    discs = np.frombuffer(plate).reshape(-1, 3)
    centres = discs[:, :2]
    towards = centres - centres[:, None]
    square = np.sum(towards**2, axis=-1)
    nearest = typical(np.partition(square, 1, axis=1)[:, 1])
    low, high = (share**2 * nearest for share in _DIAGONAL)
    # of the two diagonals through a middle, which are at right angles, one goes this way
    quarter = (towards[..., 0] > 1e-9) & (towards[..., 1] > -1e-9)
    first, second = np.nonzero((square > low) & (square < high) & quarter)
    middles = (centres[first] + centres[second]) / 2.0
    room = np.linalg.norm(middles[:, None] - centres, axis=-1) - discs[:, 2]
    return middles, float(np.min(room, initial=np.inf))
