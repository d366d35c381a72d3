"""Grids of discs: found by OpenCV as blobs, then measured one by one.

What is measured is the centre of grey of the disc's image, which is near the centre of the ellipse
that a tilted disc becomes. The image of the disc's own centre lies up to 0.1 px or so beside it;
only the camera and the pose tell where.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from handeye_cli.records import FloatArray, GreyImage, IntArray
from handeye_cli.targets.board import Detection
from handeye_cli.targets.front_view import fits_plane

_CROWD = 3
"""Blobs are kept up to this multiple of the discs: the search is cubic in their number."""
_ASTRAY = 0.5
"""A blob is not trusted when it lies farther from its place than this, in half pitches."""
_MISFIT = 0.4
"""A measured grid is refused when a disc does; lens distortion bends it less."""


@dataclass(frozen=True)
class Discs:
    """A grid of discs in an image.

    Attributes:
        pixels: (n, 2) centres, in the order of the lattice up to a turn or mirroring.
        sizes: (n,) diameters in half pitches, 0 where there is no disc.
        whole: (n,) whether the image's edge leaves the disc uncut.
    """

    pixels: FloatArray
    sizes: FloatArray
    whole: NDArray[np.bool_]

    def detection(self, order: IntArray) -> Detection:
        """Return the whole discs, where `order[k]` is the disc that is point k.

        A cut disc has no centre to be measured; it only counts for the order of the others.
        """
        ids = np.flatnonzero(self.whole[order]).astype(np.int64)
        return Detection(ids, self.pixels[order[ids]])


def find_discs(
    grey: GreyImage, lattice: IntArray, columns: int, rows: int, *, asymmetric: bool = False
) -> Discs | str:
    """Return a grid of discs, dark or light, or the reason why there is none.

    Args:
        grey: (height, width) image.
        lattice: (rows * columns, 2) lattice the discs lie on.
        columns: Discs in a row.
        rows: Rows of discs.
        asymmetric: Whether every second row is shifted.
    """
    layout = cv2.CALIB_CB_ASYMMETRIC_GRID if asymmetric else cv2.CALIB_CB_SYMMETRIC_GRID
    most = 0
    for light, strict in product((False, True), (True, False)):
        image = 255 - grey if light else grey
        blobs = _blobs(image, strict=strict)
        most = max(most, len(blobs))
        for centres in _grids(blobs[: _CROWD * len(lattice)], (columns, rows), layout):
            discs = _measured(image, lattice, centres)
            whole = discs.whole
            if np.all(discs.sizes > 0) and fits_plane(lattice[whole], discs.pixels[whole], _MISFIT):
                return discs
    if most < len(lattice):
        return f"{most} of {len(lattice)} discs were found"
    return f"{most} spots like discs were found, but no grid of {columns}x{rows} among them"


def _blobs(image: GreyImage, *, strict: bool) -> FloatArray:
    """Return the (n, 2) centres of round dark blobs, the largest first."""
    settings = cv2.SimpleBlobDetector.Params()
    settings.blobColor = 0
    if not strict:
        settings.minThreshold, settings.maxThreshold, settings.thresholdStep = 10, 245, 15
        settings.minArea, settings.minDistBetweenBlobs, settings.minConvexity = 12, 4, 0.9
    # the default loses discs of more than 80 pixels
    settings.maxArea = max(image.size / 4, settings.minArea)
    blobs = cv2.SimpleBlobDetector.create(settings).detect(image)
    blobs = sorted(blobs, key=lambda blob: -blob.size)
    return np.array([blob.pt for blob in blobs], dtype=np.float64).reshape(-1, 2)


def _grids(blobs: FloatArray, size: tuple[int, int], layout: int) -> Iterator[FloatArray]:
    """Yield the (n, 2) centres that OpenCV's two searches arrange as a grid."""
    if len(blobs) < size[0] * size[1]:
        return
    candidates = blobs[:, None].astype(np.float32)
    # OpenCV's type hints do not know that candidates go without a blob detector
    arrange: Any = cv2.findCirclesGrid
    for search in (cv2.CALIB_CB_CLUSTERING, 0):
        # the plain search draws random numbers from a generator of this thread
        cv2.setRNGSeed(0)
        found, centres = arrange(
            candidates, size, layout | search, None, cv2.CirclesGridFinderParameters()
        )
        if not found:
            continue
        ordered = np.reshape(centres, (-1, 2)).astype(np.float64)
        yield ordered
        columns, rows = size
        if layout == cv2.CALIB_CB_ASYMMETRIC_GRID and rows % 2 == 0:
            # seen sideways, such a grid comes with the two rows of each pair exchanged
            yield ordered.reshape(rows // 2, 2, columns, 2)[:, ::-1].reshape(-1, 2)


def _measured(image: GreyImage, lattice: IntArray, centres: FloatArray) -> Discs:
    """Return the dark discs near blobs in the order of the lattice; a size is 0 where none is.

    OpenCV takes the mean of a blob over grey levels, and where one of them belongs to something
    else the centre may even lie outside of the disc: such blobs are sought again at their place.
    """
    homography, _ = cv2.findHomography(lattice.astype(np.float64), centres, cv2.RANSAC, 2.0)
    if np.shape(homography) != (3, 3):
        return Discs(centres, np.zeros(len(centres)), np.zeros(len(centres), dtype=bool))
    seen = np.pad(lattice, ((0, 0), (0, 1)), constant_values=1) @ homography.T
    expected = seen[:, :2] / seen[:, 2:]
    scale = np.sqrt(np.abs(np.linalg.det(homography) / seen[:, 2] ** 3))
    astray = np.linalg.norm(centres - expected, axis=1) > _ASTRAY * scale
    starts = np.where(astray[:, None], expected, centres)
    reach = int(np.ceil(2 * scale.max()))
    # a margin no disc can cross: what touches the part's edge touches the image's
    first = np.maximum(np.floor(starts.min(axis=0)).astype(int) - 2 * reach, 0)
    last = np.ceil(starts.max(axis=0)).astype(int) + 2 * reach
    part = image[first[1] : last[1] + 1, first[0] : last[0] + 1]
    pixels, areas, whole = _centres_of_grey(part, starts - first, reach)
    return Discs(pixels + first, np.sqrt(4 / np.pi * areas) / scale, whole)


def _centres_of_grey(
    image: GreyImage, starts: FloatArray, reach: int
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Return centres, areas and wholeness of the dark spots that hold the (n, 2) starts.

    A pixel counts by how far it is from the lightest to the darkest level within `reach`.
    """
    darkness = _darkness(image, reach)
    spots = (darkness > 0.5).astype(np.uint8)
    count, labels, boxes, _ = cv2.connectedComponentsWithStats(spots, connectivity=4)
    # one pixel more on each side: the blurred edge belongs to the disc
    grown = cv2.dilate(labels.astype(np.float32), np.ones((3, 3), dtype=np.uint8))
    grown = np.where(labels > 0, labels, grown).astype(np.int64)
    size = np.array(image.shape)[::-1]
    column, row = np.clip(np.rint(starts).astype(np.int64), 0, size - 1).T
    at = labels[row, column].astype(np.int64)
    first, extent = boxes[at, :2], boxes[at, 2:4]
    whole = np.all((first > 0) & (first + extent < size), axis=1)
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    weights = (darkness, darkness * x, darkness * y)
    area, along, down = (np.bincount(grown.ravel(), each.ravel(), count)[at] for each in weights)
    area = np.where(at > 0, area, 0.0)
    centres = np.stack([along, down], axis=1) / np.maximum(area, 1.0)[:, None]
    return centres, area, whole


def _darkness(image: GreyImage, reach: int) -> FloatArray:
    """Return each pixel's level between the lightest (0) and the darkest (1) around it."""
    around = np.ones((2 * reach + 1, 2 * reach + 1), dtype=np.uint8)
    smooth = cv2.GaussianBlur(image, (0, 0), 0.7)
    light = cv2.dilate(smooth, around).astype(np.float64)
    dark = cv2.erode(smooth, around).astype(np.float64)
    return np.asarray(np.clip((light - image) / np.maximum(light - dark, 1.0), 0.0, 1.0))
