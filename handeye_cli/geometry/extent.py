"""What a box around points, its sides along the axes, says of where they are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def middle_of(points: NDArray[np.integer] | FloatArray) -> FloatArray:
    """Return the (k,) middle of the box around (n, k) points, however they are spread in it."""
    return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2.0)
