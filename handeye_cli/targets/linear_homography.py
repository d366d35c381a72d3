"""Homographies by the linear method (Hartley and Zisserman, 4.1), for one view in a few calls.

For some dozen points it takes half the time of the library's fits, which begin with it and make it
better by less than the noise of the points.
"""

from __future__ import annotations

import cv2
import numpy as np

from handeye_cli.records import FloatArray, IntArray

_IN_LINE = 1e-9
"""Square of the sine of the widest angle at which points still lie on a line."""


def linear_homography(points: FloatArray, images: FloatArray | IntArray) -> FloatArray | None:
    """Return the (3, 3) homography from points to images, None where they do not tell one.

    Its depth is 1 at the mean of the points. Fewer than 4 points tell none, nor do points or images
    on one line.

    Args:
        points: (n, 2) of one plane.
        images: (n, 2) the same in another one.
    """
    if len(points) < 4:
        return None
    first, middle = images[0], points.sum(axis=0) / len(points)
    moved = points - middle
    # numbers near 1 keep the digits of what is solved
    unit = max(float(np.max(np.abs(moved))), np.finfo(float).tiny)
    # x, y and 1 of the points, and the same times minus x and minus y of the images
    terms = np.ones((3, 3, len(points)))
    terms[:, :2] = moved.T / unit
    terms[1:] *= (first - images).T[:, None]
    rows = terms.reshape(9, -1)
    product = rows @ rows.T
    if _are_in_line(product, 0, 1) or _are_in_line(product, 5, 8):
        return None
    normal = _normal_matrix(product)
    done, solved = cv2.solve(normal[:8, :8], -normal[:8, 8:], flags=cv2.DECOMP_CHOLESKY)
    if not done:
        return None
    found = np.ones((3, 3))
    found.ravel()[:8] = solved[:, 0]
    found[:, :2] /= unit
    found[:, 2] -= found[:, :2] @ middle
    found[:2] += first[:, None] * found[2]
    return found


def _are_in_line(product: FloatArray, x: int, y: int) -> bool:
    """Return whether points lie on one line, by the sums of the products of their coordinates."""
    across = product[x, x] * product[y, y] - product[x, y] ** 2
    return bool(across <= _IN_LINE * product[x, x] * product[y, y])


def _normal_matrix(product: FloatArray) -> FloatArray:
    """Return the (9, 9) normal matrix of the linear method.

    Args:
        product: (9, 9) sums of the products of p, -x p and -y p, where p are x, y and 1 of a point,
            and x and y its image.
    """
    normal = np.zeros((9, 9))
    # the equations of x and those of y meet in the depth only
    normal[:3, :3] = normal[3:6, 3:6] = product[:3, :3]
    normal[:6, 6:] = product[3:, :3]
    normal[6:, :6] = normal[:6, 6:].T
    normal[6:, 6:] = product[3:6, 3:6] + product[6:, 6:]
    return normal
