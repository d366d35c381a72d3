"""From rough tag corners to exact ones, from the edges of the black squares through the camera."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import pnp
from handeye_cli.geometry.edge_fit import SquareFit, fit_squares
from handeye_cli.geometry.edge_pixels import Squares
from handeye_cli.records import Camera, FloatArray, GreyImage
from handeye_cli.targets.board import Detection
from handeye_cli.targets.markers import UNIT_TAG
from handeye_cli.targets.plate_map import plate_map

_CORNERS = 4
_FARTHEST = (4.0, 0.05)
"""A corner that moves by more pixels, and by more of its tag's side, went elsewhere."""
_LARGEST_MISFIT = 25.0
"""Mean square residual, over the median of all sides, of a side that is covered or stained."""
_LEAST_NOISE = 1.0
"""A grey level; what the model misses of a picture without noise must not count."""
_LOWEST_CONTRAST = 5.0
"""Contrast over noise below which a side is none."""
_LARGEST_SIGMA = 0.5
"""Standard deviation of a corner in pixels that tells nothing new."""


@dataclass(frozen=True)
class TagPrint:
    """How tags are printed.

    Attributes:
        cells: How many cells are in a row of a tag, its black border included.
        margin: Width of the white margin that surely is around each tag, in cells.
    """

    cells: int
    margin: float = 1.0


def refine_tags(
    grey: GreyImage, points: FloatArray, look: TagPrint, seen: Detection, camera: Camera | None
) -> Detection:
    """Fit the edges of the tags that were roughly found.

    Args:
        grey: (height, width) image.
        points: (4 n, 3) corners of the target's tags, four of a tag after another, metres.
        look: How the tags are printed.
        seen: The tags that were found, all four corners of each, good to about a pixel.
        camera: Intrinsics; without them a plane without distortion is assumed.

    Returns:
        The tags whose fit holds, with the pixel noise that the image's own noise leaves.
    """
    if seen.reason is not None:
        return seen
    plate = points[seen.ids, :2]
    corners, start = (each.reshape(-1, _CORNERS, 2) for each in (plate, seen.pixels))
    squares = Squares(corners, look.cells, _light_cells(grey, start, look.cells), look.margin)
    to_pixel = plate_map(plate, seen.pixels, camera)
    fit = fit_squares(grey, squares, to_pixel, start)
    light = _light_cells(grey, fit.pixels, look.cells)
    if not np.array_equal(light, squares.light):
        # Cells of two pixels are easily missed by a start that is one pixel off.
        fit = fit_squares(grey, replace(squares, light=light), to_pixel, fit.pixels)
    good = _holds(fit, start)
    if not good.any():
        tags = "the tag is" if len(good) == 1 else f"all {len(good)} tags that were found are"
        return Detection.missing(f"{tags} covered in part, too small, too blurred or too faint")
    ids = seen.ids.reshape(-1, _CORNERS)[good].ravel()
    spread = np.trace(fit.covariance[good], axis1=-2, axis2=-1) / 2.0
    pixels = fit.pixels[good].reshape(-1, 2)
    return Detection(ids, pixels, float(np.sqrt(np.mean(spread))))


def _light_cells(grey: GreyImage, quads: FloatArray, cells: int) -> NDArray[np.bool_]:
    """Return (n, 4, cells - 2): whether the cells behind the borders of (n, 4, 2) quads are light.

    The middle between the border and the margin around it decides.
    """
    centres = (np.arange(1, cells - 1) + 0.5) / cells
    x, y = np.meshgrid(centres, np.array([-0.5, 0.5, 1.5]) / cells)
    top = np.stack([x, y, np.ones_like(x)], axis=-1)
    # side k is the top of the tag after k quarter turns
    turned = np.stack([np.roll(quads, -k, axis=1) for k in range(_CORNERS)], axis=1)
    H = pnp.homography(UNIT_TAG, turned, np.ones(turned.shape[:-1], dtype=bool))
    seen = top @ np.swapaxes(H, -1, -2)[:, :, None]
    u, v = np.moveaxis(seen[..., :2] / seen[..., 2:], -1, 0).astype(np.float32)
    flat = (u.reshape(len(u), -1), v.reshape(len(v), -1))
    levels = cv2.remap(grey, *flat, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    outside, border, behind = np.moveaxis(np.reshape(levels, u.shape), 2, 0)
    middle = (np.median(outside, axis=(1, 2)) + np.median(border, axis=(1, 2))) / 2.0
    return np.asarray(behind > middle[:, None, None])


def _holds(fit: SquareFit, rough: FloatArray) -> NDArray[np.bool_]:
    """Return (n,) whether all four sides of a tag were found where it was seen, and all alike."""
    sides = np.linalg.norm(np.roll(rough, -1, axis=1) - rough, axis=-1)
    farthest = np.maximum(_FARTHEST[0], _FARTHEST[1] * np.min(sides, axis=1))
    moved = np.max(np.linalg.norm(fit.pixels - rough, axis=-1), axis=1)
    noise = max(fit.noise, _LEAST_NOISE)
    sigma = np.sqrt(np.trace(fit.covariance, axis1=-2, axis2=-1) / 2.0)
    return np.asarray(
        (moved < farthest)
        & np.all(fit.misfit < _LARGEST_MISFIT * noise**2, axis=1)
        & np.all(fit.contrast > _LOWEST_CONTRAST * noise, axis=1)
        & np.all(sigma < _LARGEST_SIGMA, axis=1)
    )
