"""A lattice as seen straight from its front, for looks that tell its corners apart."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from handeye_cli.records import FloatArray, GreyImage, IntArray

STEP = 24
"""Pixels of the front view in one pitch."""


@dataclass(frozen=True)
class FrontView:
    """An image of a lattice without perspective, with one pitch of margin.

    Attributes:
        image: (height, width) grey levels.
        corner: (2,) smallest x and y of the lattice.
    """

    image: GreyImage
    corner: IntArray

    def places(self, lattice: IntArray) -> tuple[IntArray, IntArray]:
        """Return the (n,) rows and columns of the image at (n, 2) lattice positions."""
        x, y = ((lattice - self.corner) * STEP // 2 + STEP).T
        return y, x


def front_view(grey: GreyImage, lattice: IntArray, pixels: FloatArray) -> FrontView:
    """Return the front view of a lattice whose (n, 2) points are at these pixels."""
    corner = lattice.min(axis=0)
    places = (lattice - corner) * (STEP / 2) + STEP
    width, height = (places.max(axis=0) + STEP + 1).astype(int).tolist()
    homography, _ = cv2.findHomography(places, pixels)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    image = cv2.warpPerspective(
        grey, homography, (width, height), flags=flags, borderMode=cv2.BORDER_REPLICATE
    )
    return FrontView(np.asarray(image, dtype=np.uint8), corner)


def fits_plane(positions: IntArray | FloatArray, pixels: FloatArray, tolerance: float) -> bool:
    """Say whether pixels are a view of a plane with these points, lens distortion aside.

    Args:
        positions: (n, 2) points of the plane; fewer than 4 are no view.
        pixels: (n, 2) their images.
        tolerance: Largest distance of a point to where it should be, in the units of the positions.
    """
    if len(positions) < 4:
        return False
    homography, _ = cv2.findHomography(pixels, np.asarray(positions, dtype=np.float64))
    if np.shape(homography) != (3, 3):
        return False
    back = cv2.perspectiveTransform(pixels[:, None], homography).reshape(-1, 2)
    return bool(np.max(np.linalg.norm(back - positions, axis=1)) <= tolerance)
