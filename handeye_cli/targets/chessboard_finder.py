"""Chessboards in an image: found as saddles on a lattice, in a reduced image where that will do."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye_cli.records import FloatArray, GreyImage, IntArray
from handeye_cli.targets.chessboard_reasons import Attempts
from handeye_cli.targets.layout_places import best_places
from handeye_cli.targets.resampling import reduced
from handeye_cli.targets.saddle_lattice import Part, lattice_parts
from handeye_cli.targets.saddles import find_saddles

_SIDE = 800
"""Pixels of the longer side of the image the board is sought in first, at most."""
_ABSENT = 0.25
"""Share of the corners that may be missing; they are sought at their places."""
_REACH, _WIDEST = 0.35, 12
"""Half of the refinement's window in corner spacings, less than one half, and at most, pixels."""
_ASTRAY = 0.25
"""Spacings by which the refinement may move a corner."""
_FAINTEST = 0.3
"""Contrast of a corner over the median of all."""
_ROW = 0.6
"""Share of a row, at least three corners, beside the board that tell of a larger one."""
_UNEVEN = 0.7
"""Difference of squares of one colour at a corner, over their contrast to the others."""


@dataclass(frozen=True)
class Corners:
    """The inner corners of a chessboard in an image.

    Attributes:
        pixels: (n, 2) all of them, in the order of the board up to a turn or mirroring.
        seen: (n,) whether dark and light squares meet there; the others are where they should be.
    """

    pixels: FloatArray
    seen: NDArray[np.bool_]


def find_chessboard(grey: GreyImage, columns: int, rows: int) -> Corners | str:
    """Return the chessboard in a (height, width) image, or the reason why there is none.

    Args:
        grey: (height, width) image.
        columns: Inner corners in a row.
        rows: Rows of inner corners.
    """
    row, column = np.divmod(np.arange(rows * columns), columns)
    layout = np.stack([column, row], axis=1)
    attempts = Attempts(columns, rows)
    for image, factor in _reduced(grey):
        for part in lattice_parts(find_saddles(image)):
            places, covered = best_places(layout, part.places)
            attempts.saw(part, places, covered, image.shape)
            if len(places) > 1 or covered < (1.0 - _ABSENT) * len(layout):
                continue
            # not even at another size of the image, at which the corners beside are not seen
            attempts.larger |= _goes_on(part.places, places[0])
            if not attempts.larger:
                found = _measured(grey, part, places[0].reshape(rows, columns, 2), factor)
                if found is not None:
                    return found
    return attempts.reason()


def _reduced(grey: GreyImage) -> Iterator[tuple[GreyImage, int]]:
    """Yield versions of an image, each with its factor; the smallest serves blurred images."""
    first = -(-max(grey.shape) // _SIDE)
    for factor in dict.fromkeys([first, 2 * first, -(-first // 2), 1]):
        height, width = (size // factor for size in grey.shape)
        if min(height, width) > 8:
            yield reduced(grey, factor), factor


def _goes_on(seen: IntArray, board: IntArray) -> bool:
    """Say whether most of a row or column of corners lies right beside those of a board.

    Args:
        seen: (m, 2) places of the corners that were seen.
        board: (n, 2) those of the board's corners.
    """
    low, high = board.min(axis=0), board.max(axis=0)
    beside = np.hstack([seen == low - 1, seen == high + 1])
    along = np.tile(((seen >= low) & (seen <= high))[:, ::-1], 2)
    longest = np.tile((high - low + 1)[::-1], 2)
    counts = np.count_nonzero(beside & along, axis=0)
    return bool(np.any(counts >= np.maximum(3, _ROW * longest)))


def _measured(grey: GreyImage, part: Part, places: IntArray, factor: int) -> Corners | None:
    """Return the corners at (rows, columns, 2) places of a part in a reduced image, if they are."""
    located = part.located(places.reshape(-1, 2))
    if not np.all(np.isfinite(located)):
        return None
    rough = (located + 0.5) * factor - 0.5
    steps = _steps(rough.reshape(places.shape))
    spacing = np.linalg.norm(steps, axis=-1).min(axis=-1)
    half = int(np.clip(_REACH * spacing.min(), 2, _WIDEST))
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-3)
    start = rough.reshape(-1, 1, 2).astype(np.float32)
    inside = np.all((rough > 0) & (rough < np.array(grey.shape[::-1]) - 1.0), axis=1)
    start[~inside] = 0.0
    fine = np.reshape(cv2.cornerSubPix(grey, start, (half, half), (-1, -1), criteria), (-1, 2))
    near = np.linalg.norm(fine - rough, axis=1) < _ASTRAY * spacing
    pixels = np.where(near[:, None], fine, rough)
    seen = inside & _four_squares(grey, pixels, steps)
    return Corners(pixels, seen) if np.mean(seen) >= 1.0 - _ABSENT else None


def _steps(sheet: FloatArray) -> FloatArray:
    """Return the (n, 2, 2) steps from each of (rows, columns, 2) corners to the next ones."""
    across, down = np.gradient(sheet, axis=1), np.gradient(sheet, axis=0)
    return np.asarray(np.stack([across, down], axis=2).reshape(-1, 2, 2))


def _four_squares(grey: GreyImage, pixels: FloatArray, steps: FloatArray) -> NDArray[np.bool_]:
    """Say at which of (n, 2) pixels two dark and two light squares meet, as at most of them."""
    ways = 0.25 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) @ steps
    at = (pixels[:, None] + ways).astype(np.float32)
    level = cv2.remap(
        grey, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    ).astype(np.float64)
    contrast = np.abs(level[:, 0] + level[:, 2] - level[:, 1] - level[:, 3]) / 2.0
    uneven = np.max(np.abs(level[:, :2] - level[:, 2:]), axis=1)
    clear = contrast > _FAINTEST * float(np.median(contrast))
    return np.asarray(clear & (uneven < _UNEVEN * contrast))
