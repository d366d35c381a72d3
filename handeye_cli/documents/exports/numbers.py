"""The numbers of a pose as other software writes them; every double comes back as it was."""

from __future__ import annotations

from math import atan2, cos, hypot, sin

import numpy as np

from handeye_cli.documents.poses import data_from_matrix
from handeye_cli.records import FloatArray


def translation_of(matrix: FloatArray) -> list[float]:
    """Return the x, y, z in metres of a (4, 4) pose."""
    return list(data_from_matrix(matrix)["translation"])


def quaternion_of(matrix: FloatArray) -> list[float]:
    """Return the unit quaternion x, y, z, w of a (4, 4) pose, w >= 0."""
    return list(data_from_matrix(matrix)["quaternion"])


def roll_pitch_yaw_of(matrix: FloatArray) -> list[float]:
    """Return roll, pitch and yaw of a (4, 4) pose, `R = Rz(yaw) Ry(pitch) Rx(roll)` as REP 103.

    The roll is read off the rotation with the yaw taken back, which has no gimbal lock: at a pitch
    of 90 degrees, where yaw and roll turn about one axis, whatever yaw is found is made up for.

    Args:
        matrix: (4, 4) pose.

    Returns:
        Three angles in radians: turns about the fixed axes x, y and z, in this order.
    """
    R = matrix[:3, :3]
    yaw = atan2(R[1, 0], R[0, 0])
    pitch = atan2(-R[2, 0], hypot(R[0, 0], R[1, 0]))
    s, c = sin(yaw), cos(yaw)
    roll = atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    # adding zero turns -0.0 into 0.0
    return [roll + 0.0, pitch + 0.0, yaw + 0.0]


def rows_of(matrix: FloatArray) -> list[list[float]]:
    """Return the rows of a matrix as lists."""
    # adding zero turns -0.0 into 0.0
    rows: list[list[float]] = (np.asarray(matrix, dtype=float) + 0.0).tolist()
    return rows


def words(numbers: list[float]) -> list[str]:
    """Return the shortest texts that are read back as exactly these numbers."""
    return [repr(float(number)) for number in numbers]
