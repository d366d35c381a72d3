"""From rough disc centres to the images of the true centres, through the camera if it is known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import pnp
from handeye_cli.geometry.camera import PlateToPixel
from handeye_cli.geometry.disc_conics import PlateInView, offsets_of_middles
from handeye_cli.geometry.disc_fit import DiscFit, fit_discs
from handeye_cli.geometry.disc_projection import centres_of, outlines
from handeye_cli.geometry.light_slopes import typical
from handeye_cli.geometry.two_by_two import determinants
from handeye_cli.records import Camera, FloatArray, GreyImage
from handeye_cli.targets.board import Detection
from handeye_cli.targets.plate_map import plate_map

_FARTHEST = 2.0
"""A fitted centre farther than this from where it started, in pixels, went elsewhere."""
_LARGEST_GROWTH = 0.3
_ROUNDS = 2
"""The map follows the centres, which follow the map."""
_NOTICEABLE = 0.3
"""Offsets between centres and middles, in pixels, that the pose of the plate should know of."""
_LARGEST_MISFIT = 25.0
"""Mean square residual, over the median of all discs, of a disc that is covered or stained."""
_LARGEST_SIGMA = 0.3
"""Standard deviation in pixels above which a centre is not worth having."""
_THINNEST = 1e-2
"""Shorter over longer axis of a disc's outline, below which nobody would have found a disc."""
_LOWEST_CONTRAST = 0.3
"""Contrast, over the median of all discs, below which a disc is no disc."""


def refine_discs(
    grey: GreyImage, discs: FloatArray, seen: Detection, camera: Camera | None
) -> Detection:
    """Fit the discs that were roughly found.

    Args:
        grey: (height, width) image.
        discs: (n, 3) centre (x, y) and radius of the plate's discs, metres.
        seen: The discs that were found, their centres good to about a pixel.
        camera: Intrinsics; without them a plane without distortion is assumed.

    Returns:
        The discs whose fit holds, with the pixel noise that the image's own noise leaves.
    """
    if seen.reason is not None:
        return seen
    found = discs[seen.ids]
    begun = _begun(found, seen.pixels, camera)
    if begun is None:
        return Detection.missing("with these intrinsics the plate cannot be seen where it is")
    view, start = begun
    fit = fit_discs(grey, view, start)
    good = _holds(fit, start)
    if good.sum() < pnp.MIN_POINTS:
        return Detection.missing(f"the edges of {len(found)} discs are too blurred or too faint")
    sigma = math.sqrt(float(np.mean(fit.variance[good])))
    fitted = Detection(seen.ids[good], fit.pixels[good], sigma)
    # the camera's map was as good with rough centres, the plane's was not
    return fitted if camera else _carried(found[good], fitted, view.to_pixel, None)


def recentred_discs(
    discs: FloatArray, seen: Detection, before: Camera | None, after: Camera
) -> Detection:
    """Return the images of the centres that fitted discs have with other intrinsics.

    Args:
        discs: (n, 3) centre (x, y) and radius of the plate's discs, metres.
        seen: Discs that were fitted.
        before: Intrinsics they were fitted with, None for none.
        after: Other intrinsics.
    """
    found = discs[seen.ids]
    to_pixel = plate_map(found[:, :2], seen.pixels, before)
    return _carried(found, seen, to_pixel, after)


def _carried(
    found: FloatArray, seen: Detection, to_pixel: PlateToPixel, camera: Camera | None
) -> Detection:
    """Return what was fitted with one map as the map of a camera has it."""
    rings = outlines(found, to_pixel) + (seen.pixels - to_pixel(found[:, :2]))[:, None]
    pixels = seen.pixels
    for _ in range(_ROUNDS):
        pixels = centres_of(rings, found, plate_map(found[:, :2], pixels, camera))
    return replace(seen, pixels=pixels)


def _begun(
    found: FloatArray, pixels: FloatArray, camera: Camera | None
) -> tuple[PlateInView, FloatArray] | None:
    """Return the plate's view and the centres by rough ones, or None where there is no sense in it.

    Intrinsics of some other camera, or of none, can leave no pose of the plate that shows discs.
    """
    view = PlateInView(found, plate_map(found[:, :2], pixels, camera))
    if not _are_discs(view.images, pixels):
        return None
    offsets = offsets_of_middles(view.images)
    start = pixels - offsets
    if np.max(np.abs(offsets)) > _NOTICEABLE:
        view = PlateInView(found, plate_map(found[:, :2], start, camera))
        if not _are_discs(view.images, pixels):
            return None
    return view, start


def _are_discs(images: FloatArray, pixels: FloatArray) -> bool:
    """Return whether outlines are ellipses, by their (n, 17, 2) images, and within the plate's."""
    rim = images[:, :-1] - images[:, -1:]
    if not np.max(np.abs(rim)) < np.max(pixels.max(axis=0) - pixels.min(axis=0)):
        return False
    squares = np.swapaxes(rim, 1, 2) @ rim
    thinnest = (_THINNEST * (squares[:, 0, 0] + squares[:, 1, 1])) ** 2
    # false for what is not a number, too
    return bool(np.all(determinants(squares) > thinnest))


def _holds(fit: DiscFit, rough: FloatArray) -> NDArray[np.bool_]:
    relative = fit.contrast / typical(fit.contrast)
    away = fit.pixels - rough
    return np.asarray(
        (np.hypot(away[:, 0], away[:, 1]) < _FARTHEST)
        & (np.abs(fit.growth - typical(fit.growth)) < _LARGEST_GROWTH)
        & (fit.variance < _LARGEST_SIGMA**2)
        & (fit.misfit < _LARGEST_MISFIT)
        & (relative > _LOWEST_CONTRAST)
    )
