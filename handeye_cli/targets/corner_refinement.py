"""From rough chessboard corners to measured ones, through the camera if it is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import pnp
from handeye_cli.geometry.corner_fit import CornerFit, fit_corners
from handeye_cli.records import Camera, FloatArray, GreyImage
from handeye_cli.targets.board import Detection
from handeye_cli.targets.plate_map import plate_map

_FARTHEST = 2.0
"""A fitted corner farther than this from where it started, in pixels, went elsewhere."""
_LARGEST_MISFIT = 9.0
"""Mean square residual, over the median of all corners, of one that is covered or stained."""
_LOWEST_CONTRAST = 0.3
"""Contrast, over the median of all corners, below which a corner is none."""
_LARGEST_SIGMA = 0.3
"""Standard deviation in pixels above which a corner is not worth having."""


def refine_corners(
    grey: GreyImage,
    corners: FloatArray,
    square: float,
    seen: Detection,
    camera: Camera | None,
    *,
    gap: float | None = None,
) -> Detection:
    """Fit the corners that were roughly found.

    Args:
        grey: (height, width) image.
        corners: (n, 2) corners of the board, metres; one of them is the origin.
        square: Side of a square, metres.
        seen: The corners that were found, good to about a pixel.
        camera: Intrinsics; without them a plane without distortion is assumed.
        gap: Width of the margin around what is printed in the light squares, metres, or None when
            nothing is.

    Returns:
        The corners whose fit holds, with the pixel noise that the image's own noise leaves.
    """
    if seen.reason is not None:
        return seen
    found = corners[seen.ids]
    to_pixel = plate_map(found, seen.pixels, camera)
    fit = fit_corners(grey, found, square, to_pixel, seen.pixels, gap=gap)
    good = _holds(fit, seen.pixels, np.rint(found / square).sum(axis=1))
    if not spans_a_plane(found[good]):
        return Detection.missing(f"the edges at {len(found)} corners are too blurred or too faint")
    spread = np.trace(fit.covariance[good], axis1=1, axis2=2) / 2.0
    sigma = float(np.sqrt(np.mean(spread)))
    return Detection(seen.ids[good], fit.pixels[good], sigma, note=seen.note)


def spans_a_plane(points: FloatArray) -> bool:
    """Say whether (n, 2) points are enough for a pose: four that are not all on one line."""
    return len(points) >= pnp.MIN_POINTS and bool(np.linalg.matrix_rank(points - points[0]) == 2)


def _holds(fit: CornerFit, rough: FloatArray, place: FloatArray) -> NDArray[np.bool_]:
    contrast = fit.contrast * np.where(place % 2 == 0, 1.0, -1.0)
    typical = float(np.median(contrast))
    sigma = np.sqrt(np.trace(fit.covariance, axis1=1, axis2=2) / 2.0)
    return np.asarray(
        (np.linalg.norm(fit.pixels - rough, axis=1) < _FARTHEST)
        & (fit.misfit < _LARGEST_MISFIT)
        & (contrast * np.sign(typical) > _LOWEST_CONTRAST * abs(typical))
        & (sigma < _LARGEST_SIGMA)
    )
