"""A camera before the plate: where on the plate each pixel looks, the lens and the bow included.

The inverse camera model is taken at the middles of blocks of pixels only; the rays between them are
those of polynomials.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from handeye_cli.errors import InputError, UsageError
from handeye_cli.geometry import se3
from handeye_cli.geometry.camera import normalise
from handeye_cli.records import Camera, FloatArray, IntArray
from handeye_cli.simulate.bowed import FLAT, Bow
from handeye_cli.simulate.pixel_blur import CELLS, blur_weights

STEP = 8
"""Pixels along each side of a block; the knots of the map to rays are the blocks' middles."""
_NODES = 5
"""Knots in a row that a ray is interpolated between, by a polynomial through them."""
_POLYNOMIALS = np.linalg.inv(np.vander(np.arange(_NODES), increasing=True))
_GRAZING = 0.02
"""Rays flatter than this against the plate are lifted to it, so that none misses the plane."""


@dataclass(frozen=True)
class View:
    """A camera before the plate, and where on the plate blocks of pixels look.

    The blocks cover the image and a margin of m pixels around it. Rows and columns of
    `interpolated` and of coverage count pixels from the corner of that margin.

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
    blur = blur_weights(blur_px, CELLS)
    margin = len(blur) // 2
    v, u = (_block_middles(size + 2 * margin) - margin for size in (camera.height, camera.width))
    rays = plate_rays(camera, camera_T_target, np.stack(np.meshgrid(u, v), axis=-1))
    knots = bow.met(origin, rays)
    return View(camera, blur, bow, origin, rays, knots, _reach(knots))


def _block_middles(size: int) -> FloatArray:
    """Return the positions of the middles of the blocks that cover a row of pixels."""
    count = max(_NODES, math.ceil(size / STEP))
    return np.asarray(STEP * np.arange(count) + 0.5 * (STEP - 1), dtype=np.float64)


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
    nearest = np.rint(places.mean(axis=1) / STEP - 0.5).astype(np.int64)
    first = np.clip(nearest - _NODES // 2, 0, count - _NODES)
    along = (places - (STEP - 1) / 2) / STEP - first[:, None]
    return first, along[..., None] ** np.arange(_NODES) @ _POLYNOMIALS
