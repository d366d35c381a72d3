"""Inverses of information matrices whose unknowns have units as different as metres and radians.

They are taken with a unit diagonal, which keeps the units out of the conditioning.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_NOTHING = 1e-300
"""Information below this is counted as this much."""


def scaled_inverse(information: FloatArray) -> FloatArray:
    """Return the (..., n, n) inverses of positive definite matrices."""
    scale = _scale(information)
    inverse = np.linalg.inv(_scaled(information, scale))
    return _scaled(inverse, scale)


def scaled_pseudo_inverse(information: FloatArray, rcond: float | None = None) -> FloatArray:
    """Return the (..., n, n) inverses of symmetric matrices that may be singular.

    What rounding has left without information of its own counts as not determined.

    Args:
        information: (..., n, n) matrices.
        rcond: Part of the largest eigenvalue, at a unit diagonal, below which a direction counts as
            not determined and is left at zero; rounding by itself when not given.
    """
    known = np.einsum("...ii->...i", information) > _NOTHING
    scale = np.where(known, _scale(information), 0.0)
    inverse = np.linalg.pinv(_scaled(information, scale), rcond=rcond, hermitian=True)
    return _scaled(inverse, scale)


def _scale(information: FloatArray) -> FloatArray:
    diagonal = np.einsum("...ii->...i", information)
    return np.asarray(1.0 / np.sqrt(np.maximum(diagonal, _NOTHING)))


def _scaled(matrix: NDArray[np.floating[Any]], scale: FloatArray) -> FloatArray:
    return np.asarray(scale[..., :, None] * matrix * scale[..., None, :])
