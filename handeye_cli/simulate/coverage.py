"""How much of each pixel a drawn shape covers, seen through the full camera model and a blur.

On the plate, where `plate_view` says that a pixel looks, a shape is a signed distance to each of
its sides. Blocks of pixels that are wholly inside are filled, then single pixels of the blocks that
a side may cut. A pixel that it may cut is divided into cells, each cell's share is read off its
distance to the sides, and the cells are spread by the integral of the blur over cell and pixel. So
the cost grows with the length of the outlines, not with the image.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from handeye_cli.records import FloatArray, IntArray
from handeye_cli.simulate.pixel_blur import CELLS
from handeye_cli.simulate.plate_view import STEP, View, interpolated

Distance = Callable[[FloatArray, IntArray], FloatArray]
"""Signed distances, negative inside, of (..., 2) plate points to the sides of (...) shapes.

The result is (..., k): a shape is what lies inside all of its sides, which meet at right angles.
"""


def coverage(view: View, boxes: IntArray, distance: Distance) -> FloatArray:
    """Return how much of each pixel's light comes from inside the shapes.

    Args:
        view: The camera before the plate.
        boxes: (n, 2, 2) first and last pixel (u, v) of the part of the image each shape may touch.
        distance: Signed distances of plate points to the sides of the n shapes, which may touch but
            do not overlap.

    Returns:
        (height, width) coverage in [0, 1].
    """
    shape, row, column = _blocks(view, boxes)
    inside, cut = _sorted(distance(view.knots[row, column], shape), view.reach[row, column])
    height, width = view.reach.shape
    solid = np.zeros((height * STEP, width * STEP))
    solid.reshape(height, STEP, width, STEP)[row[inside], :, column[inside]] = 1.0

    shape, row, column = shape[cut], row[cut], column[cut]
    rows, columns = (STEP * each[:, None] + np.arange(STEP) for each in (row, column))
    signed = distance(interpolated(view, rows, columns), shape[:, None, None])
    inside, cut = _sorted(signed, view.reach[row, column, None, None] / STEP)
    v, u = np.broadcast_arrays(rows[:, :, None], columns[:, None, :])
    solid[v[inside], u[inside]] = 1.0

    v, u, owner = v[cut], u[cut], shape[np.nonzero(cut)[0]]
    shares = _cell_shares(view, v, u, lambda points: distance(points, owner[:, None, None]))
    return _blur(view, solid) + _spread(view, v, u, shares)


def _blocks(view: View, boxes: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return shape, row and column of all blocks that a shape may touch."""
    last = np.array(view.reach.shape[::-1]) - 1
    first, end = np.moveaxis(np.clip((boxes + view.margin) // STEP, 0, last), 1, 0)
    size = end - first + 1
    count = size.prod(axis=1)
    shape = np.repeat(np.arange(len(boxes)), count)
    within = np.arange(len(shape)) - np.repeat(np.cumsum(count) - count, count)
    row, column = np.divmod(within, size[shape, 0])
    return shape, first[shape, 1] + row, first[shape, 0] + column


def _sorted(signed: FloatArray, reach: FloatArray) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Say what is wholly inside a shape, and what its outline may cut."""
    nearest = signed.max(axis=-1)
    return nearest < -reach, np.abs(nearest) <= reach


def _cell_shares(
    view: View, row: IntArray, column: IntArray, distance: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Return the (m, c, c) covered shares of the cells of m pixels."""
    offset = (np.arange(CELLS) + 0.5) / CELLS - 0.5
    points = interpolated(view, row[:, None] + offset, column[:, None] + offset)
    signed = distance(points)
    # Sides at right angles leave the product of their shares; shapes that touch fill each other up.
    down, across = np.asarray(np.gradient(signed, axis=(1, 2)))
    return np.asarray(half_plane_share(signed, down, across).prod(axis=-1))


def half_plane_share(signed: FloatArray, down: FloatArray, across: FloatArray) -> FloatArray:
    """Return the share of square cells on the negative side of a straight edge.

    Args:
        signed: (...) value at the centres of a function that is linear over a cell.
        down: (...) its step from cell to cell along a column.
        across: (...) its step along a row.

    Returns:
        (...) shares in [0, 1].
    """
    steps = np.abs(np.stack([down, across]))
    # Too small a step to matter, large enough to divide by.
    long = np.maximum(steps.max(axis=0), 1e-300)
    short = np.maximum(steps.min(axis=0), 1e-4 * long)
    depth = np.clip(-signed / long, -2.0, 2.0)
    outer, inner = 0.5 * (1.0 + short / long), 0.5 * (1.0 - short / long)

    def area(x: FloatArray) -> FloatArray:
        return 0.5 * np.maximum(x, 0.0) ** 2

    corners = area(depth + outer) - area(depth + inner) - area(depth - inner) + area(depth - outer)
    return np.asarray(np.clip(corners * long / short, 0.0, 1.0))


def _blur(view: View, solid: FloatArray) -> FloatArray:
    """Return the image of a map that is 1 where a pixel is filled, 0 elsewhere."""
    m, weights = view.margin, view.blur.sum(axis=1)
    seen = solid[: view.camera.height + 2 * m, : view.camera.width + 2 * m]
    down = sliding_window_view(seen, len(weights), axis=0) @ weights
    return np.asarray(sliding_window_view(down, len(weights), axis=1) @ weights)


def _spread(view: View, row: IntArray, column: IntArray, shares: FloatArray) -> FloatArray:
    """Return the image of the cells' light."""
    height, width = view.camera.height, view.camera.width
    patches = view.blur @ shares @ view.blur.T
    around = np.arange(len(view.blur)) - 2 * view.margin
    v, u = np.broadcast_arrays(row[:, None, None] + around[:, None], column[:, None, None] + around)
    seen = (v >= 0) & (v < height) & (u >= 0) & (u < width)
    flat = np.bincount((v * width + u)[seen], patches[seen], minlength=height * width)
    return np.asarray(flat.reshape(height, width))
