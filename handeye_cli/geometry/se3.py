"""Rigid transforms as (..., 4, 4) matrices: `p_A = A_T_B @ p_B`, so products chain by name.

A perturbation is a 6-vector (x, y, z, rx, ry, rz) in the parent frame: `t + dt`, `Exp(dr) R`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations

FloatArray = NDArray[np.float64]


def from_parts(R: FloatArray, t: FloatArray) -> FloatArray:
    """Return (..., 4, 4) transforms of (..., 3, 3) rotations and (..., 3) translations."""
    R, t = np.asarray(R, dtype=float), np.asarray(t, dtype=float)
    batch = np.broadcast_shapes(R.shape[:-2], t.shape[:-1])
    T = np.zeros((*batch, 4, 4))
    T[..., :3, :3] = R
    T[..., :3, 3] = t
    T[..., 3, 3] = 1.0
    return T


def inverse(T: FloatArray) -> FloatArray:
    """Return the inverse of (..., 4, 4) transforms."""
    Rt = np.swapaxes(T[..., :3, :3], -1, -2)
    return from_parts(Rt, -(Rt @ T[..., :3, 3:])[..., 0])


def transform_points(T: FloatArray, points: FloatArray) -> FloatArray:
    """Return (..., n, 3) points of the child frame in the parent's, by (..., 4, 4) transforms."""
    rotated = points @ np.swapaxes(T[..., :3, :3], -1, -2)
    return np.asarray(rotated + T[..., None, :3, 3])


def perturb(T: FloatArray, d: FloatArray) -> FloatArray:
    """Return transforms moved by (..., 6) perturbations in the parent frame."""
    d = np.asarray(d, dtype=float)
    return from_parts(rotations.exp(d[..., 3:]) @ T[..., :3, :3], T[..., :3, 3] + d[..., :3])


def difference(T: FloatArray, origin: FloatArray) -> FloatArray:
    """Return the (..., 6) perturbations that take `origin` to `T`; the inverse of `perturb`."""
    turn = T[..., :3, :3] @ np.swapaxes(origin[..., :3, :3], -1, -2)
    return np.concatenate([T[..., :3, 3] - origin[..., :3, 3], rotations.log(turn)], axis=-1)


def by_kind(squares: FloatArray) -> FloatArray:
    """Return (..., 2) sums over the axes of translation and of rotation, in this order.

    Args:
        squares: (..., 6) squares or variances of a perturbation's components.
    """
    return np.asarray(squares.reshape(*squares.shape[:-1], 2, 3).sum(axis=-1))


def _blocks(upper_left: FloatArray, upper_right: FloatArray, lower_right: FloatArray) -> FloatArray:
    batch = np.broadcast_shapes(
        upper_left.shape[:-2], upper_right.shape[:-2], lower_right.shape[:-2]
    )
    J = np.zeros((*batch, 6, 6))
    J[..., :3, :3], J[..., :3, 3:], J[..., 3:, 3:] = upper_left, upper_right, lower_right
    return J


def compose_jacobians(A: FloatArray, B: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (..., 6, 6) derivatives of the product's perturbation by those of A and of B."""
    R = A[..., :3, :3]
    lever = (R @ B[..., :3, 3:])[..., 0]
    left = _blocks(np.eye(3), -rotations.skew(lever), np.eye(3))
    return left, _blocks(R, np.zeros((3, 3)), R)


def inverse_jacobian(T: FloatArray) -> FloatArray:
    """Return the (..., 6, 6) derivative of the inverse's perturbation by that of T."""
    Rt = np.swapaxes(T[..., :3, :3], -1, -2)
    return _blocks(-Rt, -Rt @ rotations.skew(T[..., :3, 3]), -Rt)


def mean(T: FloatArray) -> FloatArray:
    """Return the mean of (..., N, 4, 4) transforms: chordal rotation, plain translation."""
    return from_parts(rotations.mean(T[..., :3, :3]), np.mean(T[..., :3, 3], axis=-2))
