"""Covariance matrices of documents: symmetric and positive semidefinite, or refused."""

from __future__ import annotations

from typing import Any

import numpy as np

from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError
from handeye_cli.records import FloatArray

_ROUNDING = 1e-6
"""Departure from symmetry, and below zero, that rounded digits explain; relative to the sigmas."""


def covariance_from_data(rows: list[list[Any]], size: int, place: Place) -> FloatArray:
    """Return a covariance from its rows, made exactly symmetric.

    Both tests are made on the matrix scaled to correlations, so that they mean the same for
    metres, radians and pixels.

    Args:
        rows: Rows of finite numbers.
        size: Number of rows and columns it must have.
        place: Where it stands.

    Returns:
        (size, size) covariance.

    Raises:
        InputError: It has another size, is not symmetric, or has a negative eigenvalue.
    """
    if len(rows) != size or any(len(row) != size for row in rows):
        lengths = " or ".join(str(length) for length in sorted({len(row) for row in rows}))
        found = f"{len(rows)} rows of {lengths}"
        raise InputError(f"expected {size} rows of {size} numbers, found {found}", where=str(place))
    given = np.array(rows, dtype=float)
    covariance = 0.5 * given + 0.5 * given.T
    sigma = _sigmas(covariance)
    asymmetry = np.abs(_scaled(given, sigma) - _scaled(given.T, sigma))
    row, column = np.unravel_index(np.argmax(asymmetry), asymmetry.shape)
    if asymmetry[row, column] > _ROUNDING:
        raise InputError(
            f"expected a symmetric covariance, found {given[row, column]:g} at "
            f"[{row}][{column}] and {given[column, row]:g} at [{column}][{row}]",
            where=str(place),
        )
    if np.linalg.eigvalsh(_scaled(covariance, sigma))[0] < -_ROUNDING:
        raise InputError(
            "expected a covariance without negative eigenvalues, found the eigenvalue "
            f"{np.linalg.eigvalsh(covariance)[0]:.3g}",
            where=str(place),
        )
    return covariance


def data_from_covariance(covariance: FloatArray | None) -> list[list[float]] | None:
    """Return the rows of a covariance, or None for an unknown one."""
    return None if covariance is None else (covariance + 0.0).tolist()


def _sigmas(covariance: FloatArray) -> FloatArray:
    """Return the standard deviations, a zero replaced by the largest of them."""
    sigma = np.sqrt(np.abs(np.diagonal(covariance)))
    return np.where(sigma > 0.0, sigma, np.max(sigma) or 1.0)


def _scaled(matrix: FloatArray, sigma: FloatArray) -> FloatArray:
    return np.asarray(matrix / sigma[:, None] / sigma)
