"""What every solver takes and gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Problem:
    """Stations of one recording, or of many trials along leading axes.

    Attributes:
        A: (..., N, 4, 4) reference_T_mount.
        B: (..., N, 4, 4) camera_T_target.
        pairs: (m, 2) interstation pairs, for the methods that use them.
        covariance: (N, 12, 12) of the perturbations of A_i and B_i together.
    """

    A: FloatArray
    B: FloatArray
    pairs: IntArray
    covariance: FloatArray


@dataclass(frozen=True)
class Solution:
    """The unknowns of the loop.

    Attributes:
        X: (..., 4, 4) mount_T_camera.
        Z: (..., 4, 4) reference_T_target.
        converged: Whether an iterative solver settled in every trial.
    """

    X: FloatArray
    Z: FloatArray
    converged: bool = True
