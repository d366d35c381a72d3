"""Rotations as matrices, quaternions (x y z w), rotation vectors, Euler angles, the paper's axes.

Every function takes any leading axes. Angles are computed with atan2 of a quaternion's parts, which
keeps full accuracy near 0 and near pi, where an arccos of the trace loses half of the digits.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_SMALL = 1e-4
"""Below this angle in radians the series is more accurate than the closed form."""


def skew(v: FloatArray) -> FloatArray:
    """Return the cross-product matrices, `skew(a) @ b = a x b`, eq. (11e).

    Args:
        v: (..., 3) vectors.

    Returns:
        (..., 3, 3) matrices.
    """
    v = np.asarray(v, dtype=float)
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    # filled in place: `np.stack` of so many numbers takes longer than all else here
    K = np.zeros((*v.shape[:-1], 3, 3))
    K[..., 0, 1], K[..., 0, 2], K[..., 1, 2] = -z, y, -x
    K[..., 1, 0], K[..., 2, 0], K[..., 2, 1] = z, -y, x
    return K


def exp(v: FloatArray) -> FloatArray:
    """Return the rotation matrices of rotation vectors.

    Args:
        v: (..., 3) rotation vectors in radians.

    Returns:
        (..., 3, 3) rotation matrices.
    """
    v = np.asarray(v, dtype=float)
    half = 0.5 * np.linalg.norm(v, axis=-1, keepdims=True)
    scale = 0.5 * np.where(half < _SMALL, 1.0 - half**2 / 6.0, np.sinc(half / np.pi))
    return matrix_from_quaternion(np.concatenate([scale * v, np.cos(half)], axis=-1))


def log(R: FloatArray) -> FloatArray:
    """Return the rotation vectors of rotation matrices, with an angle in [0, pi].

    Args:
        R: (..., 3, 3) rotation matrices.

    Returns:
        (..., 3) rotation vectors in radians. At an angle of pi one of the two axes is taken.
    """
    q = quaternion_from_matrix(R)
    sine = np.linalg.norm(q[..., :3], axis=-1, keepdims=True)
    half = np.arctan2(sine, q[..., 3:])
    tiny = sine < _SMALL
    scale = np.where(tiny, 2.0 + sine**2 / 3.0, 2.0 * half / np.where(tiny, 1.0, sine))
    return np.asarray(scale * q[..., :3])


def angle(R: FloatArray) -> FloatArray:
    """Return the rotation angles in [0, pi] radians of (..., 3, 3) matrices, shape (...)."""
    q = quaternion_from_matrix(R)
    return np.asarray(2.0 * np.arctan2(np.linalg.norm(q[..., :3], axis=-1), q[..., 3]))


def matrix_from_quaternion(q: FloatArray) -> FloatArray:
    """Return the rotation matrices of quaternions, which are normalised first.

    Args:
        q: (..., 4) quaternions x y z w, not zero.

    Returns:
        (..., 3, 3) rotation matrices.
    """
    q = np.asarray(q, dtype=float)
    x, y, z, w = np.moveaxis(q / np.linalg.norm(q, axis=-1, keepdims=True), -1, 0)
    R = np.empty((*q.shape[:-1], 3, 3))
    R[..., 0, 0] = 1 - 2 * (y * y + z * z)
    R[..., 0, 1] = 2 * (x * y - z * w)
    R[..., 0, 2] = 2 * (x * z + y * w)
    R[..., 1, 0] = 2 * (x * y + z * w)
    R[..., 1, 1] = 1 - 2 * (x * x + z * z)
    R[..., 1, 2] = 2 * (y * z - x * w)
    R[..., 2, 0] = 2 * (x * z - y * w)
    R[..., 2, 1] = 2 * (y * z + x * w)
    R[..., 2, 2] = 1 - 2 * (x * x + y * y)
    return R


def quaternion_from_matrix(R: FloatArray) -> FloatArray:
    """Return the unit quaternions of rotation matrices, with w >= 0.

    Each quaternion is read off the row of `4 q q'` with the largest diagonal element, so none of
    its parts is found by a cancelling subtraction.

    Args:
        R: (..., 3, 3) rotation matrices.

    Returns:
        (..., 4) quaternions x y z w.
    """
    R = np.asarray(R, dtype=float)
    xx, yy, zz = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    outer = np.empty((*R.shape[:-2], 4, 4))
    outer[..., 0, 0] = 1 + xx - yy - zz
    outer[..., 1, 1] = 1 - xx + yy - zz
    outer[..., 2, 2] = 1 - xx - yy + zz
    outer[..., 3, 3] = 1 + xx + yy + zz
    outer[..., 0, 1] = outer[..., 1, 0] = R[..., 0, 1] + R[..., 1, 0]
    outer[..., 0, 2] = outer[..., 2, 0] = R[..., 0, 2] + R[..., 2, 0]
    outer[..., 1, 2] = outer[..., 2, 1] = R[..., 1, 2] + R[..., 2, 1]
    outer[..., 0, 3] = outer[..., 3, 0] = R[..., 2, 1] - R[..., 1, 2]
    outer[..., 1, 3] = outer[..., 3, 1] = R[..., 0, 2] - R[..., 2, 0]
    outer[..., 2, 3] = outer[..., 3, 2] = R[..., 1, 0] - R[..., 0, 1]
    best = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(outer, best[..., None, None], axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.asarray(np.where(q[..., 3:] < 0, -q, q))


def principal_axis(R: FloatArray) -> FloatArray:
    """Return the paper's rotation axis `P = 2 sin(angle / 2) n`, eq. (9).

    Args:
        R: (..., 3, 3) rotation matrices.

    Returns:
        (..., 3) axes of length at most 2. At a length of 2 the sign of the axis is open.
    """
    return np.asarray(2.0 * quaternion_from_matrix(R)[..., :3])


def matrix_from_euler(angles: FloatArray, order: str) -> FloatArray:
    """Return the rotation matrices of Euler angles.

    Args:
        angles: (..., 3) angles in radians, in the order of the axes in `order`.
        order: Three letters; lower case (`xyz`) turns about the fixed axes one after the other,
            upper case (`ZYX`) about the axes that turn along, as in SciPy.

    Returns:
        (..., 3, 3) rotation matrices.

    Raises:
        ValueError: `order` is not three letters of one case out of x, y and z.
    """
    if len(order) != 3 or not (set(order) <= set("xyz") or set(order) <= set("XYZ")):
        raise ValueError(f"expected an order such as 'xyz' or 'ZYX', found {order!r}")
    axes = np.eye(3)[["xyz".index(letter) for letter in order.lower()]]
    turns = exp(np.asarray(angles, dtype=float)[..., None] * axes)
    first, second, third = turns[..., 0, :, :], turns[..., 1, :, :], turns[..., 2, :, :]
    return third @ second @ first if order.islower() else first @ second @ third


def project_to_so3(M: FloatArray) -> FloatArray:
    """Return the rotation matrices nearest to (..., 3, 3) matrices in the Frobenius norm."""
    U, _, Vt = np.linalg.svd(np.asarray(M, dtype=float))
    sign = np.ones((*U.shape[:-2], 3))
    sign[..., 2] = np.linalg.det(U @ Vt)
    return np.asarray(U @ (sign[..., None] * Vt))


def mean(R: FloatArray) -> FloatArray:
    """Return the chordal mean (..., 3, 3) of (..., N, 3, 3) rotation matrices."""
    return project_to_so3(np.mean(R, axis=-3))


def align(targets: FloatArray, sources: FloatArray) -> FloatArray:
    """Return the (..., 3, 3) rotations R that bring `R @ sources` nearest to `targets`.

    The cross product of the first two pairs is added as a third, so two vectors are enough.

    Args:
        targets: (..., m, 3) vectors, m >= 2.
        sources: (..., m, 3) vectors.
    """
    outer = np.einsum("...mi,...mj->...ij", targets, sources)
    normal_t = np.cross(targets[..., 0, :], targets[..., 1, :])
    normal_s = np.cross(sources[..., 0, :], sources[..., 1, :])
    return project_to_so3(outer + normal_t[..., :, None] * normal_s[..., None, :])


def left_jacobian_inverse(v: FloatArray) -> FloatArray:
    """Return J with `Log(Exp(d) Exp(v)) = v + J d` to first order in d.

    Args:
        v: (..., 3) rotation vectors shorter than 2 pi.

    Returns:
        (..., 3, 3) Jacobians; the right-hand one is that of `-v`.
    """
    v = np.asarray(v, dtype=float)
    theta = np.linalg.norm(v, axis=-1)[..., None, None]
    tiny = theta < 1e-2
    safe = np.where(tiny, 1.0, theta)
    exact = (1.0 - 0.5 * safe / np.tan(0.5 * safe)) / safe**2
    K = skew(v)
    return np.asarray(
        np.eye(3) - 0.5 * K + np.where(tiny, 1 / 12 + theta**2 / 720, exact) * (K @ K)
    )
