"""Linear equations in the elements of rotation matrices, for the Kronecker product's methods.

A matrix is a vector of its nine elements, row by row, so `P M Q'` is `kron(P, Q)` times M. The
rotation equations are homogeneous: they give the matrices up to a common factor, and up to more
where all motions are half turns. Where the published methods leave the factor to the translations,
their equations lose rank as soon as all motions keep one common point fixed - cameras that look at
the target's origin from one distance, as in Tsai and Lenz' layout, do. Here what the rotation
equations leave open is taken from the rotations themselves: determinant +1, and, out of several
null vectors, the one next to a rough rotation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations
from handeye_cli.solvers.problem import FloatArray

_OPEN = 1e-6
"""Share of the largest eigenvalue up to which a direction is open however small the noise is: axes
0.2 degrees apart, or half turns to within a milliradian."""
_HIDDEN = 25.0
"""A direction whose squared residuals are below this multiple of the best one's hides in noise."""
_HELD = 0.95
"""Share of the rough rotation's squared length that the open directions have to hold."""
_SINGULAR = 1e-13
"""Relative size of an eigenvalue that is nothing but rounding."""


def kron(P: FloatArray, Q: FloatArray) -> FloatArray:
    """Return the (..., 9, 9) Kronecker products of (..., 3, 3) matrices."""
    product = np.einsum("...ij,...kl->...ikjl", P, Q)
    return np.asarray(product.reshape(*product.shape[:-4], 9, 9))


def by_turn(R: FloatArray) -> FloatArray:
    """Return the (..., 9, 3) derivative of a rotation's elements by a turn in the parent frame.

    Half its transpose takes a change of the elements back to the turn of the nearest rotation.
    """
    turned = np.einsum("kij,...jl->...ilk", rotations.skew(np.eye(3)), R)
    return np.asarray(turned.reshape(*turned.shape[:-3], 9, 3))


def row_weights(motion_g: FloatArray, motion_c: FloatArray) -> FloatArray:
    """Return weights that make nine rotation and three translation equations comparable.

    An error of a rotation moves the translations by the length of the lever, so lengths are
    measured in that of the motions; the answer then does not depend on their unit.

    Args:
        motion_g: (..., m, 4, 4) motions of the mount.
        motion_c: (..., m, 4, 4) motions of the camera.

    Returns:
        (..., 1, 12) weights, to be applied to equations of any number of motions or stations.
    """
    squares = motion_g[..., :3, 3] ** 2 + motion_c[..., :3, 3] ** 2
    length = np.sqrt(0.5 * np.mean(np.sum(squares, axis=-1), axis=-1))
    weights = np.ones((*length.shape, 1, 12))
    weights[..., 9:] = (1.0 / np.where(length > 0.0, length, 1.0))[..., None, None]
    return weights


def null_rotations(rows: FloatArray, rough: FloatArray) -> FloatArray:
    """Return the rotations that solve homogeneous equations best.

    Args:
        rows: (..., m, 9, 9 k) equations in the elements of k rotations.
        rough: (..., k, 3, 3) rough solution; it settles the sign and, between several null
            vectors, the choice.

    Returns:
        (..., k, 3, 3) rotations.
    """
    values, vectors = np.linalg.eigh(_gram(rows))
    shares = np.swapaxes(vectors, -1, -2) @ rough.reshape(*rough.shape[:-3], -1, 1)
    is_open = _open_directions(values, shares[..., 0] ** 2)
    elements = vectors @ (is_open[..., None] * shares)
    return rotations.project_to_so3(elements.reshape(rough.shape))


def _open_directions(values: FloatArray, held: FloatArray) -> NDArray[np.bool_]:
    """Tell which directions, in ascending order of their squared residuals, are null vectors.

    Usually it is the first alone. More are needed where noise has mixed several null vectors, so
    that the first does not hold the rough solution.
    """
    hidden = values <= np.maximum(_OPEN * values[..., -1:], _HIDDEN * values[..., :1])
    before = np.cumsum(held, axis=-1) - held
    return np.asarray(hidden | (before < _HELD * np.sum(held, axis=-1, keepdims=True)))


def solve_free(rows: FloatArray, right: FloatArray) -> FloatArray:
    """Return the (..., n) least squares solution of (..., m, p, n) equations, all unknowns free.

    Args:
        rows: (..., m, p, n) coefficients.
        right: (..., m, p) right-hand sides.
    """
    size = rows.shape[-1]
    flat = np.concatenate([rows, right[..., None]], axis=-1).reshape(*rows.shape[:-3], -1, size + 1)
    # a QR step and not the normal equations: the columns may be in millimetres
    reduced = np.asarray(np.linalg.qr(flat, mode="r"))
    inverse = np.linalg.pinv(reduced[..., :size, :size])
    return np.asarray((inverse @ reduced[..., :size, size:])[..., 0])


def solve_scaled(rows: FloatArray, right: FloatArray, R: FloatArray) -> FloatArray:
    """Return the least squares solution whose rotations' elements have the scale of rotations.

    Args:
        rows: (..., m, p, n) coefficients; the elements of the rotations come first.
        right: (..., m, p) right-hand sides.
        R: (..., k, 3, 3) rotations near the solution; along their elements it is kept as long as
            they are.

    Returns:
        (..., n) solutions.
    """
    fixed = _padded(R, rows.shape[-1])
    scale = np.sum(fixed**2, axis=-1, keepdims=True)
    vector = np.concatenate([_moment(rows, right), scale], axis=-1)
    inverse = _bordered_inverse(rows, fixed)
    return np.asarray((inverse @ vector[..., None])[..., :-1, 0])


def scaled_influence(rows: FloatArray, R: FloatArray, residual: FloatArray) -> FloatArray:
    """Return how the solution of `solve_scaled`, or of `null_rotations`, moves with its data.

    The residuals vanish for perfect data, so to first order the unknowns move by the inverse of
    the normal equations times the change of the residuals.

    Args:
        rows: (m, p, n) coefficients.
        R: (k, 3, 3) rotations of the solution.
        residual: (m, p, 12) derivative of each residual by its own poses' perturbations.

    Returns:
        (m, n, 12) derivatives of the unknowns.
    """
    inverse = _bordered_inverse(rows, _padded(R, rows.shape[-1]))[:-1, :-1]
    return np.asarray(-inverse @ np.swapaxes(rows, -1, -2) @ residual)


def _padded(R: FloatArray, length: int) -> FloatArray:
    elements = R.reshape(*R.shape[:-3], -1)
    padded = np.zeros((*elements.shape[:-1], length))
    padded[..., : elements.shape[-1]] = elements
    return padded


def _bordered_inverse(rows: FloatArray, fixed: FloatArray) -> FloatArray:
    """Return the inverse of the normal equations bordered by the scale's constraint."""
    size = rows.shape[-1]
    bordered = np.zeros((*rows.shape[:-3], size + 1, size + 1))
    bordered[..., :size, :size] = _gram(rows)
    bordered[..., size, :size] = bordered[..., :size, size] = fixed
    return np.asarray(np.linalg.pinv(bordered, rcond=_SINGULAR, hermitian=True))


def _gram(rows: FloatArray) -> FloatArray:
    flat = rows.reshape(*rows.shape[:-3], -1, rows.shape[-1])
    return np.asarray(np.swapaxes(flat, -1, -2) @ flat)


def _moment(rows: FloatArray, right: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("...mpn,...mp->...n", rows, right))
