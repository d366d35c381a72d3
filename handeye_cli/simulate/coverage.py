"""How much of each pixel a drawn shape covers, seen through the full camera model and a blur.

The inverse camera model takes pixels to the plate, where a shape is a signed distance. A pixel
wholly inside counts one. A pixel that an outline may cut is divided into cells, each cell's share
is read off its distance to the outline, and the cells are spread by the integral of the blur over
cell and pixel. So the cost grows with the length of the outlines, not with the image.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from handeye_cli.errors import InputError, UsageError
from handeye_cli.geometry import se3
from handeye_cli.geometry.camera import normalise
from handeye_cli.records import Camera, FloatArray, IntArray

Distance = Callable[[FloatArray, IntArray], FloatArray]
"""Signed distance, negative inside, of (..., 2) plate points to the outlines of (...) shapes."""

_CELLS = 4
"""Cells along each side of a pixel that an outline cuts."""
_STEP = 8
"""Pixels between the knots of the coarse map, which sorts pixels into inside, edge and outside."""
_GRAZING = 0.02
"""Rays flatter than this against the plate are lifted to it, so that none misses the plane."""


@dataclass(frozen=True)
class View:
    """A camera before the plate, and where on the plate each pixel looks, nearly.

    Attributes:
        camera: The intrinsics.
        camera_T_target: (4, 4) pose of the plate.
        blur: (2 m + 1, c) weights of one pixel's c cells in the pixels around it.
        points: (height + 2 m, width + 2 m, 2) plate points of the pixels and a margin of m around
            the image, interpolated, metres.
        reach: (height + 2 m, width + 2 m) radius on the plate that a pixel surely stays in, metres.
    """

    camera: Camera
    camera_T_target: FloatArray
    blur: FloatArray
    points: FloatArray
    reach: FloatArray

    @property
    def margin(self) -> int:
        """Pixels around the image from which the blur still carries light into it."""
        return len(self.blur) // 2


def look(camera: Camera, camera_T_target: FloatArray, blur_px: float) -> View:
    """Prepare the view of a plate.

    Args:
        camera: The intrinsics.
        camera_T_target: (4, 4) pose of the plate, seen from its front.
        blur_px: Standard deviation of the Gaussian blur, pixels.

    Raises:
        UsageError: The blur is negative, or the camera is behind the plate.
        InputError: The distortion leaves pixels without a direction.
    """
    if not 0.0 <= blur_px < math.inf:
        raise UsageError(f"expected a blur of 0 px or more, found {blur_px:g} px")
    height = -float(se3.inverse(camera_T_target)[2, 3])
    if height <= 0.0:
        raise UsageError(
            f"expected the camera in front of the plate, found it {-1e3 * height:g} mm behind",
            hint="the target's z axis points into the plate",
        )
    blur = blur_weights(blur_px, _CELLS)
    points = _coarse_points(camera, camera_T_target, len(blur) // 2)
    down, across = np.gradient(points, axis=(0, 1))
    diagonals = np.stack([down + across, down - across])
    # The corners are half a diagonal away; the rest covers the interpolation.
    reach = 0.6 * np.linalg.norm(diagonals, axis=-1).max(axis=0)
    return View(camera, camera_T_target, blur, points, reach)


def plate_points(camera: Camera, camera_T_target: FloatArray, pixels: FloatArray) -> FloatArray:
    """Return the (..., 2) points of the plate, metres, that (..., 2) pixels look at.

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
    depth = -target_T_camera[2, 3] / np.maximum(along[..., 2:], _GRAZING)
    return np.asarray(target_T_camera[:2, 3] + depth * along[..., :2])


def _coarse_points(camera: Camera, camera_T_target: FloatArray, margin: int) -> FloatArray:
    down = _interpolation(camera.height + 2 * margin)
    across = _interpolation(camera.width + 2 * margin)
    v, u = np.meshgrid(np.arange(down.shape[1]), np.arange(across.shape[1]), indexing="ij")
    knots = _STEP * np.stack([u, v], axis=-1).astype(float) - margin
    points = plate_points(camera, camera_T_target, knots)
    return np.stack([down @ points[..., k] @ across.T for k in (0, 1)], axis=-1)


def _interpolation(size: int) -> FloatArray:
    """Return the (size, knots) weights of linear interpolation between knots."""
    knots = np.arange((size - 1) // _STEP + 2)
    return np.maximum(0.0, 1.0 - np.abs(np.arange(size)[:, None] / _STEP - knots))


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
        distance: Signed distance of plate points to the n shapes, which do not overlap.

    Returns:
        (height, width) coverage in [0, 1].
    """
    rows, columns = np.broadcast_arrays(*_box_pixels(view, boxes))
    owner = np.arange(len(boxes))[:, None, None]
    signed, reach = distance(view.points[rows, columns], owner), view.reach[rows, columns]
    inside, edge = signed < -reach, np.abs(signed) <= reach
    solid = np.zeros(view.reach.shape)
    solid[rows[inside], columns[inside]] = 1.0
    row, column, cut = rows[edge], columns[edge], np.nonzero(edge)[0]
    shares = _cell_shares(view, row, column, lambda points: distance(points, cut[:, None, None]))
    return _blur(solid, view.blur.sum(axis=1)) + _spread(view, row, column, shares)


def _box_pixels(view: View, boxes: IntArray) -> tuple[IntArray, IntArray]:
    """Return (n, h, 1) rows and (n, 1, w) columns into the view's maps, all boxes of one size."""
    limit = np.array([view.reach.shape[1], view.reach.shape[0]])
    size = np.minimum((boxes[:, 1] - boxes[:, 0]).max(axis=0) + 1, limit)
    first = np.clip(boxes[:, 0] + view.margin, 0, limit - size)
    columns = first[:, None, None, 0] + np.arange(size[0])
    rows = first[:, None, None, 1] + np.arange(size[1])[:, None]
    return rows, columns


def _cell_shares(
    view: View, row: IntArray, column: IntArray, distance: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Return the (m, c, c) covered shares of the cells of m pixels of the view's maps."""
    offset = (np.arange(_CELLS) + 0.5) / _CELLS - 0.5 - view.margin
    u, v = np.broadcast_arrays(column[:, None, None] + offset, row[:, None, None] + offset[:, None])
    pixels = np.stack([u, v], axis=-1)
    signed = distance(plate_points(view.camera, view.camera_T_target, pixels))
    return half_plane_share(signed, *np.gradient(signed, axis=(1, 2)))


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


def _blur(solid: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the part of a map inside its margin, blurred along rows and columns."""
    down = sliding_window_view(solid, len(weights), axis=0) @ weights
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
