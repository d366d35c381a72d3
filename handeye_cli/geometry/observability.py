"""Whether the motions determine the answer, judged against the noise and not machine precision."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations, statistics

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_NUMERICAL_FLOOR = 1e-9
_FEWEST_MOTIONS = 6
_CERTAIN_AXIS = 1.95
"""Length of an axis beyond which noise may turn it round: 2 sin(angle / 2) for 154 deg."""
_NEAR_HALF = 0.3
"""Radians from a half turn up to which noise, even a lot, may turn an axis round."""


class MotionSpread(NamedTuple):
    """How the interstation rotations spread over angles and axes.

    Attributes:
        largest_angle: Of robot and camera, the smaller of their largest rotation angles, radians.
        mismatch: RMS difference of the robot's and the camera's rotation angles, radians: noise,
            seen without solving anything.
        median_mismatch: Median of the same difference, which one bad station cannot move.
        second_axis: RMS component of the rotation axes of eq. (9) across their main direction.
        main_axis: (3,) that direction, a unit vector in the mount's frame.
    """

    largest_angle: float
    mismatch: float
    median_mismatch: float
    second_axis: float
    main_axis: FloatArray


def motion_spread(motion_g: FloatArray, motion_c: FloatArray) -> MotionSpread:
    """Measure the spread of interstation motions.

    Args:
        motion_g: (m, 4, 4) motions of the mount.
        motion_c: (m, 4, 4) motions of the camera for the same pairs.
    """
    angle_g = rotations.angle(motion_g[:, :3, :3])
    angle_c = rotations.angle(motion_c[:, :3, :3])
    difference = angle_g - angle_c
    P_g = rotations.principal_axis(motion_g[:, :3, :3])
    P_c = rotations.principal_axis(motion_c[:, :3, :3])
    _, sizes_g, directions = np.linalg.svd(P_g, full_matrices=False)
    sizes_c = np.linalg.svd(P_c, compute_uv=False)
    return MotionSpread(
        largest_angle=float(min(np.max(angle_g), np.max(angle_c))),
        mismatch=max(float(np.sqrt(np.mean(difference**2))), _NUMERICAL_FLOOR),
        median_mismatch=statistics.median(np.abs(difference)),
        second_axis=float(min(sizes_g[1], sizes_c[1]) / np.sqrt(len(P_g))),
        main_axis=directions[0],
    )


def half_turns(first: FloatArray, others: FloatArray) -> BoolArray:
    """Return which motions from one rotation to others are nearly half turns.

    Where none is, every motion has an axis whose sign is certain. Rotations about more than one
    axis that allow two answers have a half turn here, whichever of them comes first.

    Args:
        first: (..., 3, 3) rotations.
        others: (..., N, 3, 3) rotations.

    Returns:
        (..., N) of the others.
    """
    traces = np.einsum("...ij,...nij->...n", first, others)
    return np.asarray(traces < 1.0 - 2.0 * np.cos(_NEAR_HALF))


class ScrewScale(NamedTuple):
    """Lengths of the mount's motions over those of the camera's.

    Attributes:
        ratio: Slope of the translations along the rotation axes; 1 for consistent units.
        sigma: Relative standard deviation of the ratio from the scatter; infinite where the motions
            have no translation along their axes.
        signal: Translation along the axes over all of it, RMS, of the side where it is less; what
            rotation noise feigns is at most its own size in radians.
    """

    ratio: float
    sigma: float
    signal: float


def screw_scale(motion_g: FloatArray, motion_c: FloatArray) -> ScrewScale:
    """Compare the lengths of interstation motions without solving anything.

    The translation along its rotation axis is the same for both sides of `H_g X = X H_c`, whatever
    X is; the axes' lengths of eq. (9) weigh it, so that small rotations do not disturb.

    Args:
        motion_g: (m, 4, 4) motions of the mount.
        motion_c: (m, 4, 4) motions of the camera for the same pairs.
    """
    along_g, along_c = (_along_axis(motion) for motion in (motion_g, motion_c))
    squares_g, squares_c = float(along_g @ along_g), float(along_c @ along_c)
    product = float(along_g @ along_c)
    if product <= 0.0 or len(along_g) < _FEWEST_MOTIONS:
        return ScrewScale(1.0, np.inf, 0.0)
    explained = product**2 / (squares_g * squares_c)
    spread = max(1.0 - explained, 0.0) / (explained * (len(along_g) - 1))
    lengths = [float(np.sum(motion[:, :3, 3] ** 2)) for motion in (motion_g, motion_c)]
    signal = min(squares_g / max(lengths[0], 1e-300), squares_c / max(lengths[1], 1e-300))
    return ScrewScale(product / squares_c, float(np.sqrt(spread)), float(np.sqrt(signal)))


def _along_axis(motion: FloatArray) -> FloatArray:
    """Return the (m,) translations along the axes P of eq. (9), those near pi left out."""
    P = rotations.principal_axis(motion[:, :3, :3])
    certain = np.linalg.norm(P, axis=1) < _CERTAIN_AXIS
    return np.asarray(np.sum(P * motion[:, :3, 3], axis=1) * certain)


def nearest_axis(direction: FloatArray) -> str | None:
    """Return `x`, `y` or `z` for a unit vector within 10 degrees of that axis, else None."""
    best = int(np.argmax(np.abs(direction)))
    return "xyz"[best] if abs(direction[best]) > np.cos(np.radians(10.0)) else None
