"""The plane of a lattice in an image: the homography from pixels to places.

A finder asks for it in every image, and mostly no point is astray: then the linear method will do.
"""

from __future__ import annotations

import cv2
import numpy as np

from handeye_cli.records import FloatArray, IntArray
from handeye_cli.targets.disc_spots import BoolArray
from handeye_cli.targets.linear_homography import linear_homography

_WELL = 0.5
"""Share of the distance at which a point is astray, within which all fit well."""


def agreed_plane(
    pixels: FloatArray, places: IntArray, astray: float
) -> tuple[FloatArray | None, BoolArray]:
    """Return the (3, 3) homography from pixels to places, if any, and which points it fits.

    It is the one through all points if they fit it well, else the one that most points agree on.

    Args:
        pixels: (n, 2) points.
        places: (n, 2) where they are on a lattice.
        astray: Distance from its place from which on a point does not fit.
    """
    plane = linear_homography(pixels, places)
    if plane is not None:
        seen = pixels @ plane[:, :2].T + plane[:, 2]
        # not divided by the depth, which is 0 on the horizon
        depth, off = seen[:, 2], seen[:, :2] - seen[:, 2:] * places
        fitting = np.hypot(off[:, 0], off[:, 1]) < _WELL * astray * depth
        if np.all(fitting):
            return plane, np.asarray(fitting)
    return _library_plane(pixels, places, cv2.RANSAC, astray)


def nearest_plane(pixels: FloatArray, places: IntArray) -> FloatArray | None:
    """Return the (3, 3) homography with the least squares of distances from places, if any.

    It is the better one where others beside the points are to be told by it.

    Args:
        pixels: (n, 2) points.
        places: (n, 2) where they are on a lattice.
    """
    return _library_plane(pixels, places)[0]


def _library_plane(
    pixels: FloatArray, places: IntArray, method: int = 0, astray: float = 0.0
) -> tuple[FloatArray | None, BoolArray]:
    none = np.zeros(len(places), dtype=np.bool_)
    if len(places) < 4:
        return None, none
    found, fitting = cv2.findHomography(pixels, places.astype(np.float64), method, astray)
    if np.shape(found) != (3, 3):
        return None, none
    return np.asarray(found, dtype=np.float64), np.ravel(fitting) > 0
