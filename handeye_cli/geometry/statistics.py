"""Median and quantiles, without the masked arrays that numpy's own would load."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def median(values: FloatArray) -> float:
    """Return the median of (n,) numbers."""
    middle = (len(values) - 1) // 2, len(values) // 2
    return float(np.mean(np.partition(values, middle)[list(middle)]))


def quantile(values: FloatArray, part: float) -> float:
    """Return the quantile of (n,) numbers, linear between them."""
    return float(np.interp(part * (len(values) - 1), np.arange(len(values)), np.sort(values)))
