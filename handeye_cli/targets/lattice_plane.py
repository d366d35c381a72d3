"""The plane of a lattice in an image: the homography from pixels to places.

One view is fitted here, and a finder asks for it in every image: for some dozen points the general
fits of the libraries take several times as long.
"""

from __future__ import annotations

import cv2
import numpy as np

from handeye_cli.records import FloatArray, IntArray
from handeye_cli.targets.disc_spots import BoolArray

_UNIT = 100.0
"""Pixels in which the points are counted: numbers near 1 keep the digits of what is solved."""


def fitted_plane(
    pixels: FloatArray, places: IntArray, astray: float
) -> tuple[FloatArray | None, BoolArray]:
    """Return the (3, 3) homography from pixels to places, if any, and which points it fits.

    All points are tried first, as mostly none is astray, then those that most agree on.

    Args:
        pixels: (n, 2) points.
        places: (n, 2) where they are on a lattice.
        astray: Distance from its place within which a point fits.
    """
    plane = plane_through(pixels, places)
    if plane is not None:
        seen = pixels @ plane[:, :2].T + plane[:, 2]
        # not divided by the depth, which is 0 on the horizon
        depth, off = seen[:, 2], seen[:, :2] - seen[:, 2:] * places
        fitting = np.hypot(off[:, 0], off[:, 1]) < astray * depth
        if np.all(fitting):
            return plane, np.asarray(fitting)
    none = np.zeros(len(places), dtype=np.bool_)
    if len(places) < 4:
        return None, none
    robust, inliers = cv2.findHomography(pixels, places.astype(np.float64), cv2.RANSAC, astray)
    if np.shape(robust) != (3, 3):
        return None, none
    return np.asarray(robust, dtype=np.float64), np.ravel(inliers) > 0


def plane_through(pixels: FloatArray, places: IntArray) -> FloatArray | None:
    """Return the (3, 3) homography from pixels to places by the linear method.

    Its depth is 1 at the mean of the pixels. Fewer than 4 points have none, nor have places on one
    line.

    Args:
        pixels: (n, 2) points.
        places: (n, 2) where they are on a lattice.
    """
    if len(places) < 4:
        return None
    first, middle = places[0], pixels.sum(axis=0) / len(pixels)
    moved = pixels - middle
    # x, y and 1 of the pixels, and the same times minus x and minus y of the places
    terms = np.ones((3, 3, len(places)))
    terms[:, :2] = moved.T / _UNIT
    terms[1:] *= (first - places).T[:, None]
    rows = terms.reshape(9, -1)
    product = rows @ rows.T
    # the sums of the squares of whole numbers say whether the places lie on one line
    if product[5, 5] * product[8, 8] == product[5, 8] ** 2:
        return None
    # the blocks of the normal equations, in which x and y of a place do not meet
    normal = np.zeros((9, 9))
    normal[:3, :3] = normal[3:6, 3:6] = product[:3, :3]
    normal[:6, 6:] = product[3:, :3]
    normal[6:, :6] = normal[:6, 6:].T
    normal[6:, 6:] = product[3:6, 3:6] + product[6:, 6:]
    done, solved = cv2.solve(normal[:8, :8], -normal[:8, 8:], flags=cv2.DECOMP_CHOLESKY)
    if not done:
        return None
    plane = np.ones((3, 3))
    plane.ravel()[:8] = solved[:, 0]
    plane[:, :2] /= _UNIT
    plane[:, 2] -= plane[:, :2] @ middle
    plane[:2] += first[:, None] * plane[2]
    return plane
