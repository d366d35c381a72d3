"""Whether the motions determine the answer, judged against the noise and not machine precision."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations

FloatArray = NDArray[np.float64]

_NUMERICAL_FLOOR = 1e-9


@dataclass(frozen=True)
class MotionSpread:
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
        median_mismatch=float(np.median(np.abs(difference))),
        second_axis=float(min(sizes_g[1], sizes_c[1]) / np.sqrt(len(P_g))),
        main_axis=directions[0],
    )


def nearest_axis(direction: FloatArray) -> str | None:
    """Return `x`, `y` or `z` for a unit vector within 10 degrees of that axis, else None."""
    best = int(np.argmax(np.abs(direction)))
    return "xyz"[best] if abs(direction[best]) > np.cos(np.radians(10.0)) else None
