"""The paper's eq. (10), from its rotation axes back to matrices: what eq. (9) is held against."""

import numpy as np

from handeye_cli.geometry.rotations import skew


def matrix_from_principal_axis(P):
    """Return (..., 3, 3) rotations of (..., 3) axes of length at most 2."""
    square = np.sum(P * P, axis=-1)[..., None, None]
    alpha = np.sqrt(np.maximum(4.0 - square, 0.0))
    outer = P[..., :, None] * P[..., None, :]
    return (1.0 - square / 2.0) * np.eye(3) + 0.5 * (outer + alpha * skew(P))
