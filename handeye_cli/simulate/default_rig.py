"""A rig for those who do not care which: camera, target and robot as one might find them."""

from __future__ import annotations

import numpy as np

from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.records import Camera, FloatArray

TARGET = "disc-grid:6x6:5mm:4mm"
"""The paper's plate."""
_FILLED = 0.4
"""Part of the image that a target spans at the distance that is chosen for it."""
_FACING = rotations.exp(np.array([np.pi, 0.0, 0.0]))


def mount_T_camera(setup: Setup) -> FloatArray:
    """Return the (4, 4) pose of a camera on its mount.

    On a gripper it sits as far off as in the paper, 9.5 in; on the base it stands beside the robot
    and looks at what the robot holds up.
    """
    if setup is Setup.EYE_IN_HAND:
        R = rotations.exp(np.array([0.35, -0.25, 1.4]))
        return se3.from_parts(R, np.array([0.11, -0.12, 0.178]))
    R = rotations.exp(np.array([0.0, 0.0, 0.3])) @ rotations.exp(np.array([-1.9, 0.0, 0.0]))
    return se3.from_parts(R, np.array([0.2, -0.5, 0.6]))


def reference_T_target(setup: Setup) -> FloatArray:
    """Return the (4, 4) pose of a target: face up on a table, or face outwards on a gripper."""
    if setup is Setup.EYE_IN_HAND:
        R = rotations.exp(np.array([0.0, 0.0, 0.4])) @ _FACING
        return se3.from_parts(R, np.array([0.55, -0.12, 0.035]))
    R = rotations.exp(np.array([0.1, 0.05, -0.6])) @ _FACING
    return se3.from_parts(R, np.array([0.02, -0.03, 0.09]))


def filling_distance(points: FloatArray, camera: Camera) -> float:
    """Return how far a camera is from (n, 3) points of a target that fill a good part of its image.

    Args:
        points: Of the target, metres.
        camera: The intrinsics.
    """
    extent = np.ptp(points[:, :2], axis=0)
    room = _FILLED * np.array([camera.width / camera.fx, camera.height / camera.fy])
    return float(np.max(extent / room))
