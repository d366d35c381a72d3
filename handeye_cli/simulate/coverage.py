"""How much of each pixel a drawn shape covers, seen through the full camera model and a blur.

The inverse camera model takes pixels to the plate, where a shape is a signed distance to each of
its sides. Blocks of pixels that are wholly inside are filled, then single pixels of the blocks that
a side may cut. A pixel that it may cut is divided into cells, each cell's share is read off its
distance to the sides, and the cells are spread by the integral of the blur over cell and pixel. So
the cost grows with the length of the outlines, not with the image.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from handeye_cli.errors import InputError, UsageError
from handeye_cli.geometry import se3
from handeye_cli.geometry.camera import normalise
from handeye_cli.records import Camera, FloatArray, IntArray
from handeye_cli.simulate.bowed import FLAT, Bow

Distance = Callable[[FloatArray, IntArray], FloatArray]
"""Signed distances, negative inside, of (..., 2) plate points to the sides of (...) shapes.

The result is (..., k): a shape is what lies inside all of its sides, which meet at right angles.
"""

_CELLS = 4
"""Cells along each side of a pixel that an outline cuts."""
_STEP = 8
"""Pixels along each side of a block; the knots of the map to rays are the blocks' middles."""
_NODES = 5
"""Knots in a row that a ray is interpolated between, by a polynomial through them."""
_POLYNOMIALS = np.linalg.inv(np.vander(np.arange(_NODES), increasing=True))
_GRAZING = 0.02
"""Rays flatter than this against the plate are lifted to it, so that none misses the plane."""


@dataclass(frozen=True)
class View:
    """A camera before the plate, and where on the plate blocks of pixels look.

    The blocks cover the image and a margin of m pixels around it. Rows and columns of the functions
    below count pixels from the corner of that margin.

    Attributes:
        camera: The intrinsics.
        blur: (2 m + 1, c) weights of one pixel's c cells in the pixels around it.
        bow: How the plate is bent.
        origin: (3,) where the camera is, in the plate's frame, metres.
        rays: (h, w, 2) ways in x and y for each metre in z of the rays of the blocks' middles.
        knots: (h, w, 2) plate points of the blocks' middles, metres.
        reach: (h, w) radius on the plate that a block surely stays in, metres.
    """

    camera: Camera
    blur: FloatArray
    bow: Bow
    origin: FloatArray
    rays: FloatArray
    knots: FloatArray
    reach: FloatArray

    @property
    def margin(self) -> int:
        """Pixels around the image from which the blur still carries light into it."""
        return len(self.blur) // 2


def look(camera: Camera, camera_T_target: FloatArray, blur_px: float, bow: Bow = FLAT) -> View:
    """Prepare the view of a plate.

    Args:
        camera: The intrinsics.
        camera_T_target: (4, 4) pose of the plate, seen from its front.
        blur_px: Standard deviation of the Gaussian blur, pixels.
        bow: How the plate is bent.

    Raises:
        UsageError: The blur is negative, or the camera is behind the plate.
        InputError: The distortion leaves pixels without a direction.
    """
    if not 0.0 <= blur_px < math.inf:
        raise UsageError(f"expected a blur of 0 px or more, found {blur_px:g} px")
    origin = se3.inverse(camera_T_target)[:3, 3]
    height = -float(origin[2])
    if height <= 0.0:
        raise UsageError(
            f"expected the camera in front of the plate, found it {-1e3 * height:g} mm behind",
            hint="the target's z axis points into the plate",
        )
    blur = blur_weights(blur_px, _CELLS)
    margin = len(blur) // 2
    v, u = (_block_middles(size + 2 * margin) - margin for size in (camera.height, camera.width))
    rays = plate_rays(camera, camera_T_target, np.stack(np.meshgrid(u, v), axis=-1))
    knots = bow.met(origin, rays)
    return View(camera, blur, bow, origin, rays, knots, _reach(knots))


def _block_middles(size: int) -> FloatArray:
    """Return the positions of the middles of the blocks that cover a row of pixels."""
    count = max(_NODES, math.ceil(size / _STEP))
    return np.asarray(_STEP * np.arange(count) + 0.5 * (_STEP - 1), dtype=np.float64)


def _reach(knots: FloatArray) -> FloatArray:
    """Return the (h, w) radii on the plate of the blocks around (h, w, 2) knots."""
    diagonals = np.stack([knots[1:, 1:] - knots[:-1, :-1], knots[1:, :-1] - knots[:-1, 1:]])
    # A block's corners are half a diagonal away; the rest covers what bends on the way.
    between = np.pad(0.6 * np.linalg.norm(diagonals, axis=-1).max(axis=0), 1, mode="edge")
    return np.asarray(sliding_window_view(between, (2, 2)).max(axis=(2, 3)))


def plate_rays(camera: Camera, camera_T_target: FloatArray, pixels: FloatArray) -> FloatArray:
    """Return the (..., 2) ways in x and y of the plate for each metre in its z, of pixels' rays.

    Args:
        camera: The intrinsics.
        camera_T_target: (4, 4) pose of the plate.
        pixels: (..., 2) u and v.

    Raises:
        InputError: The distortion leaves a pixel without a direction.
    """
    rays = normalise(pixels, camera.parameters, camera.model)
    if not np.all(np.isfinite(rays)):
        u, v = pixels[~np.isfinite(rays).all(axis=-1)][0]
        raise InputError(
            f"expected a distortion that maps the whole image, found none at pixel ({u:g}, {v:g})",
            where="camera",
            hint="check the distortion coefficients and their model",
        )
    target_T_camera = se3.inverse(camera_T_target)
    along = rays @ target_T_camera[:3, :2].T + target_T_camera[:3, 2]
    return np.asarray(along[..., :2] / np.maximum(along[..., 2:], _GRAZING))


def blur_weights(blur_px: float, cells: int) -> FloatArray:
    """Return how much a lit cell adds to each pixel around the cell's own.

    Averaging the scene over cells and spreading it over them again widens the blur by a variance of
    a sixth of a squared cell, which the Gaussian therefore leaves out.

    Args:
        blur_px: Standard deviation of the Gaussian, pixels.
        cells: Number c of cells across a pixel.

    Returns:
        (2 m + 1, c) integrals over pixel and cell, of sum 1; m covers five standard deviations.
    """
    margin = math.ceil(5.0 * blur_px + 0.5)
    sigma = math.sqrt(max(0.0, blur_px**2 - 1.0 / (6.0 * cells**2)))
    edges = (np.arange(cells + 1) / cells - 0.5) - np.arange(-margin, margin + 1)[:, None]
    ramp = _blurred_ramp(edges + 0.5, sigma) - _blurred_ramp(edges - 0.5, sigma)
    return np.diff(ramp, axis=1)


def _blurred_ramp(x: FloatArray, sigma: float) -> FloatArray:
    """Return max(x, 0) after a Gaussian blur, the second integral of the Gaussian."""
    if sigma == 0.0:
        return np.maximum(x, 0.0)
    z = x / sigma
    below = np.array([0.5 * math.erfc(-each / math.sqrt(2.0)) for each in z.ravel()])
    density = np.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
    return np.asarray(x * below.reshape(x.shape) + sigma * density)


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
    solid = np.zeros((height * _STEP, width * _STEP))
    solid.reshape(height, _STEP, width, _STEP)[row[inside], :, column[inside]] = 1.0

    shape, row, column = shape[cut], row[cut], column[cut]
    rows, columns = (_STEP * each[:, None] + np.arange(_STEP) for each in (row, column))
    signed = distance(interpolated(view, rows, columns), shape[:, None, None])
    inside, cut = _sorted(signed, view.reach[row, column, None, None] / _STEP)
    v, u = np.broadcast_arrays(rows[:, :, None], columns[:, None, :])
    solid[v[inside], u[inside]] = 1.0

    v, u, owner = v[cut], u[cut], shape[np.nonzero(cut)[0]]
    shares = _cell_shares(view, v, u, lambda points: distance(points, owner[:, None, None]))
    return _blur(view, solid) + _spread(view, v, u, shares)


def _blocks(view: View, boxes: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return shape, row and column of all blocks that a shape may touch."""
    last = np.array(view.reach.shape[::-1]) - 1
    first, end = np.moveaxis(np.clip((boxes + view.margin) // _STEP, 0, last), 1, 0)
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


def interpolated(
    view: View, rows: FloatArray | IntArray, columns: FloatArray | IntArray
) -> FloatArray:
    """Return the plate points of rays from the polynomials through those of the knots around them.

    Args:
        view: The camera before the plate.
        rows: (m, a) rows, the a of each line not farther apart than a block is large.
        columns: (m, b) columns, likewise.

    Returns:
        (m, a, b, 2) points on the plate, metres.
    """
    (row, down), (column, across) = (
        _nodes(places, count)
        for places, count in zip((rows, columns), view.reach.shape, strict=True)
    )
    node = np.arange(_NODES)
    knots = view.rays[(row[:, None] + node)[:, :, None], (column[:, None] + node)[:, None]]
    lines = down @ knots.reshape(len(rows), _NODES, 2 * _NODES)
    return view.bow.met(view.origin, across[:, None] @ lines.reshape(*rows.shape, _NODES, 2))


def _nodes(places: FloatArray | IntArray, count: int) -> tuple[IntArray, FloatArray]:
    """Return the (m,) first of the knots around (m, a) places, and the knots' (m, a, k) weights."""
    nearest = np.rint(places.mean(axis=1) / _STEP - 0.5).astype(np.int64)
    first = np.clip(nearest - _NODES // 2, 0, count - _NODES)
    along = (places - (_STEP - 1) / 2) / _STEP - first[:, None]
    return first, along[..., None] ** np.arange(_NODES) @ _POLYNOMIALS


def _cell_shares(
    view: View, row: IntArray, column: IntArray, distance: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Return the (m, c, c) covered shares of the cells of m pixels."""
    offset = (np.arange(_CELLS) + 0.5) / _CELLS - 0.5
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
