"""Whether the robot's poses agree with the intrinsics that the images give.

Together with the robot's poses the intrinsics settle elsewhere than by the images alone. How far is
a matter of chance: the squares of the move, in the images' standard deviations, are a sum of
chi-squares, one for every direction, weighted with the part of its variance that the robot's poses
take away. A larger move says that noise is not what is wrong.
"""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry.joint_bundle import LinearLoops
from handeye_cli.geometry.tail_probabilities import f_tail
from handeye_cli.records import Camera, Finding, FloatArray

_SIGNIFICANCE = 1e-3
"""Chance that good data are blamed."""
_NOTHING = 1e-3
"""Sum of the weights below which the robot's poses say nothing of the intrinsics."""


def check_intrinsics(
    linear: LinearLoops, covariance: FloatArray, freedom: float, before: Camera, after: Camera
) -> Finding | None:
    """Return a warning where robot poses and images want different intrinsics, else None.

    Args:
        linear: The loops at the joint optimum.
        covariance: (m, m) of the intrinsics there.
        freedom: Degrees of freedom with which the robot's noise was estimated; infinite when given.
        before: The camera by the images alone.
        after: The camera by both.
    """
    weights = _weights(linear.information, covariance)
    expected = float(np.sum(weights))
    if expected < _NOTHING:
        return None
    squares = float(linear.gradient @ np.linalg.solve(linear.information, linear.gradient))
    if _chance(squares, weights, freedom) > _SIGNIFICANCE:
        return None
    return Finding(
        "intrinsics-contradicted",
        "warning",
        f"the robot's poses and the images want different intrinsics: a focal length of "
        f"{before.fx:.1f} px by the images, {after.fx:.1f} px by both, chi-square {squares:.1f} "
        f"where {expected:.1f} is expected",
        "something else than noise is wrong, such as a station, a bent target, or the lens model; "
        "trust 'handeye verify' more than the predicted error",
    )


def _weights(information: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return (m,) parts of the variance by views alone that the robot's poses take away."""
    values, vectors = np.linalg.eigh(information)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return np.asarray(np.clip(1.0 - np.linalg.eigvalsh(root.T @ covariance @ root), 0.0, 1.0))


def _chance(squares: float, weights: FloatArray, freedom: float) -> float:
    """Return the probability of squares as large as these; mean and variance are matched."""
    mean = float(np.sum(weights))
    count = mean**2 / float(np.sum(weights**2))
    return f_tail(squares / mean, count, freedom)
