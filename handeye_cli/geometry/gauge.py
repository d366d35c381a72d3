"""The free part of an answer at a stated choice: as near to a guess as the loops let it be.

A free rotation is the one nearest to that of the guess; a free translation is that of the guess
along its direction.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.free_directions import Freedom, complement

FloatArray = NDArray[np.float64]


def gauge_step(X: FloatArray, near: FloatArray, free: Freedom) -> FloatArray:
    """Return the (12,) step of X and Z that takes X's free parts to the guess's; Z's is zero.

    The best turn by phi about an axis a makes the scalar part of the quaternion (v, w) between the
    two rotations largest: that is `w cos(phi/2) - a.v sin(phi/2)`, so `tan(phi/2) = -a.v / w`.

    Args:
        X: (4, 4) an answer.
        near: (4, 4) the guess.
        free: What may be chosen.
    """
    step = np.zeros(12)
    step[:3] = free.translations.T @ (free.translations @ (near[:3, 3] - X[:3, 3]))
    apart = X[:3, :3] @ near[:3, :3].T
    if len(free.rotations) == 1:
        (axis,), q = free.rotations, rotations.quaternion_from_matrix(apart)
        step[3:6] = 2.0 * np.arctan2(-axis @ q[:3], q[3]) * axis
    elif len(free.rotations):
        step[3:6] = -rotations.log(apart)
    return step


def at_gauge(
    A: FloatArray, B: FloatArray, X: FloatArray, near: FloatArray, free: Freedom
) -> tuple[FloatArray, FloatArray]:
    """Move X along its free directions to a guess, and all else so that the loops nearly close.

    A long way along a free rotation is a screw, not a step: with the rotation at its place the
    translations are found anew, which is linear.

    Args:
        A: (N, 4, 4) reference_T_mount.
        B: (N, 4, 4) camera_T_target.
        X: (4, 4) an answer.
        near: (4, 4) the guess.
        free: What may be chosen.

    Returns:
        X and Z, (4, 4).
    """
    R = rotations.exp(gauge_step(X, near, free)[3:6]) @ X[:3, :3]
    held = free.translations.T @ (free.translations @ near[:3, 3])
    across = complement(free.translations)
    seen = A[:, :3, 3] + (A[:, :3, :3] @ (B[:, :3, 3] @ R.T + held)[..., None])[..., 0]
    turned = A[:, :3, :3] @ across
    rows = (turned - turned.mean(axis=0)).reshape(3 * len(A), -1)
    fit = np.linalg.pinv(rows) @ -(seen - seen.mean(axis=0)).reshape(-1)
    X = se3.from_parts(R, held + across @ fit)
    return X, se3.mean(A @ X @ B)
