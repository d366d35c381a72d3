"""The plane of a lattice in an image: the homography from pixels to places.

A finder asks for it in every image, and mostly no point is astray: then the linear method will do,
which for some dozen points takes half the time of the library's fits.
"""

from __future__ import annotations

import cv2
import numpy as np

from handeye_cli.records import FloatArray, IntArray
from handeye_cli.targets.disc_spots import BoolArray

_WELL = 0.5
"""Share of the distance at which a point is astray, within which all fit well."""
_UNIT = 100.0
"""Pixels in which the points are counted: numbers near 1 keep the digits of what is solved."""


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
    plane = linear_plane(pixels, places)
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


def linear_plane(pixels: FloatArray, places: IntArray) -> FloatArray | None:
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
    normal = _normal_matrix(product)
    done, solved = cv2.solve(normal[:8, :8], -normal[:8, 8:], flags=cv2.DECOMP_CHOLESKY)
    if not done:
        return None
    plane = np.ones((3, 3))
    plane.ravel()[:8] = solved[:, 0]
    plane[:, :2] /= _UNIT
    plane[:, 2] -= plane[:, :2] @ middle
    plane[:2] += first[:, None] * plane[2]
    return plane


def _normal_matrix(product: FloatArray) -> FloatArray:
    """Return the (9, 9) normal matrix of the linear method.

    Args:
        product: (9, 9) sums of the products of p, -x p and -y p, where p are x, y and 1 of a pixel,
            and x and y a place.
    """
    normal = np.zeros((9, 9))
    # the equations of x and those of y meet in the depth only
    normal[:3, :3] = normal[3:6, 3:6] = product[:3, :3]
    normal[:6, 6:] = product[3:, :3]
    normal[6:, :6] = normal[:6, 6:].T
    normal[6:, 6:] = product[3:6, 3:6] + product[6:, 6:]
    return normal
