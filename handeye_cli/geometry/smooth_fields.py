"""Errors of poses that are alike where the poses are: fields, smooth over the space of poses.

A field is random and normal, isotropic, and two of its values correlate the less the farther apart
the poses are. The kernels here take residuals that are whitened for independent errors.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations
from handeye_cli.geometry.tail_probabilities import f_tail, quadratic_ratio_tail

FloatArray = NDArray[np.float64]

_DEPENDENT = 1e-9
"""Part of a column that is left beside others it depends on, by rounding alone."""
_TAKEN_UP = 0.03
"""Part of a column that the fit leaves, at most, where the column says nothing.

Poses with noise leave something even of what the fit takes up, such as a scale on a circle of
stations; that something depends on the same noise as the residuals do.
"""


class WhiteResiduals(NamedTuple):
    """Residuals of N stations with unit variance, and what was fitted to them.

    Attributes:
        values: (N, 6) residuals.
        basis: (6 N, q) orthonormal, of what was fitted.
        by_robot: (N, 6, 6) their derivative by the perturbation of each robot pose.
    """

    values: FloatArray
    basis: FloatArray
    by_robot: FloatArray

    @property
    def left(self) -> FloatArray:
        """(6 N,) what the fit leaves of them."""
        return self.beside(self.values.reshape(-1, 1))[:, 0]

    @property
    def freedom(self) -> int:
        """Degrees of freedom of what is left."""
        return int(self.basis.shape[0] - self.basis.shape[1])

    @property
    def free(self) -> FloatArray:
        """(6 N, 6 N - q) orthonormal basis of what was not fitted."""
        whole, _ = np.linalg.qr(self.basis, mode="complete")
        return np.asarray(whole[:, self.basis.shape[1] :])

    def likeness(self, covariance: FloatArray) -> float:
        """Return the chance that independent residuals look as much like a covariance as these.

        That is the score test of a variance; the size of the noise is left open.

        Args:
            covariance: (6 N, 6 N) of the residuals, up to a factor and to that of the noise.
        """
        free = self.free
        A = free.T @ covariance @ free
        z = free.T @ self.values.ravel()
        ratio = float(z @ A @ z / max(float(z @ z), np.finfo(float).tiny))
        return quadratic_ratio_tail(np.asarray(np.linalg.eigvalsh(A), dtype=np.float64), ratio)

    def beside(self, columns: FloatArray) -> FloatArray:
        """Return the part of (6 N, k) columns that the fit does not take up."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))


class Trend(NamedTuple):
    """How residuals follow k columns.

    Attributes:
        values: (k,) coefficients of the columns.
        covariance: (k, k) of them.
        chance: That residuals without a trend follow the columns as much.
    """

    values: FloatArray
    covariance: FloatArray
    chance: float


def whitened(
    residuals: FloatArray, covariance: FloatArray, fitted: FloatArray, by_robot: FloatArray
) -> WhiteResiduals:
    """Whiten residuals.

    Args:
        residuals: (N, 6).
        covariance: (N, 6, 6) of them, stations being independent.
        fitted: (N, 6, q) derivatives by what was fitted, or is to be.
        by_robot: (N, 6, 6) derivative by the perturbation of each robot pose.
    """
    root = np.linalg.cholesky(covariance)
    design = np.linalg.solve(root, fitted).reshape(-1, fitted.shape[-1])
    size = np.linalg.norm(design, axis=0)
    U, s, _ = np.linalg.svd(design[:, size > 0] / size[size > 0], full_matrices=False)
    values = np.linalg.solve(root, residuals[..., None])[..., 0]
    return WhiteResiduals(values, U[:, s > _DEPENDENT * s[0]], np.linalg.solve(root, by_robot))


def trend(residuals: WhiteResiduals, columns: FloatArray) -> Trend:
    """Fit columns and judge what they explain by Fisher's F; the noise's scale is left open.

    Args:
        residuals: Of N stations.
        columns: (N, 6, k) perturbations of the robot poses for unit coefficients.
    """
    moved = (residuals.by_robot @ columns).reshape(-1, columns.shape[-1])
    size = np.maximum(np.linalg.norm(moved, axis=0), np.finfo(float).tiny)
    U, s, Vt = np.linalg.svd(residuals.beside(moved / size), full_matrices=False)
    seen = s > _TAKEN_UP
    rank, below = int(seen.sum()), residuals.freedom - int(seen.sum())
    left = residuals.left
    along = U[:, seen].T @ left
    noise = max(float(left @ left - along @ along), np.finfo(float).tiny) / max(below, 1)
    to_values = Vt[seen].T / s[seen] / size[:, None]
    if rank == 0 or below < 1:
        return Trend(to_values @ along, noise * to_values @ to_values.T, 1.0)
    chance = f_tail(float(along @ along) / rank / noise, rank, below)
    return Trend(to_values @ along, noise * to_values @ to_values.T, chance)


def spreads(poses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (N, 3) positions and rotation vectors of (N, 4, 4) poses about their means."""
    middle = rotations.mean(poses[:, :3, :3])
    turned = rotations.log(poses[:, :3, :3] @ middle.T)
    return poses[:, :3, 3] - poses[:, :3, 3].mean(axis=0), turned


def correlation(poses: FloatArray, length: float) -> FloatArray:
    """Return the (N, N) correlations of a smooth field between (N, 4, 4) poses.

    Args:
        poses: The poses.
        length: At which it has fallen to exp(-1/2), in units of the RMS spread of the positions
            and of the rotations, which count alike.
    """
    square = np.zeros((len(poses), len(poses)))
    for part in spreads(poses):
        size = float(np.mean(np.sum(part**2, axis=1)))
        if size > 0.0:
            square += np.sum((part[:, None] - part) ** 2, axis=-1) / size
    return np.asarray(np.exp(-0.5 * square / length**2))


def field_covariance(by_robot: FloatArray, correlations: FloatArray, part: slice) -> FloatArray:
    """Return the (6 N, 6 N) covariance that a field of unit variance in each axis gives residuals.

    Args:
        by_robot: (N, 6, 6) derivative of the residuals by each robot pose's perturbation.
        correlations: (N, N) of the field.
        part: Of the perturbation: its translation or its rotation.
    """
    moved = by_robot[..., part]
    products = np.einsum("iad,ij,jbd->iajb", moved, correlations, moved, optimize=True)
    return np.asarray(products.reshape(6 * len(moved), -1))


def block_diagonal(blocks: FloatArray) -> FloatArray:
    """Return the (6 N, 6 N) matrix with (N, 6, 6) blocks on its diagonal."""
    count = len(blocks)
    whole = np.zeros((count, 6, count, 6))
    whole[np.arange(count), :, np.arange(count)] = blocks
    return whole.reshape(6 * count, -1)


def restricted_log_likelihood(
    residuals: FloatArray, basis: FloatArray, covariance: FloatArray
) -> float:
    """Return the log-likelihood of what is left of (n,) residuals beside (n, q) fitted columns."""
    weighted = np.linalg.solve(covariance, np.column_stack([basis, residuals]))
    inner = basis.T @ weighted[:, :-1]
    along = basis.T @ weighted[:, -1]
    squares = residuals @ weighted[:, -1] - along @ np.linalg.solve(inner, along)
    determinants = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(inner)[1]
    return float(-0.5 * (determinants + squares))
