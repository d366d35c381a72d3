"""Stations on the paper's circle, section IV-A1, and the angles that decide their accuracy.

The target's z axis points into the plate, so the paper's C_0, straight above and looking down, is
the identity rotation at z = -distance.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def circle_angles(count: int) -> FloatArray:
    """Return the (count,) directions 360 i / count degrees of the turning axes, in radians."""
    return 2.0 * np.pi * np.arange(count) / count


def between_angles(count: int, wanted: int) -> FloatArray:
    """Return directions half-way between neighbours of the circle, spread evenly over it.

    Args:
        count: Number of stations on the circle.
        wanted: Number of directions, at most `count`.

    Returns:
        (wanted,) angles in radians, rising.

    Raises:
        ValueError: More directions are wanted than the circle has gaps.
    """
    if not 0 <= wanted <= count:
        raise ValueError(f"expected 0 to {count} directions between {count}, found {wanted}")
    gap = np.arange(wanted) * count // max(wanted, 1)
    return 2.0 * np.pi * (gap + 0.5) / count


def tilted_stations(
    angles: ArrayLike, distance: ArrayLike, tilt: ArrayLike, centre: ArrayLike = (0.0, 0.0, 0.0)
) -> FloatArray:
    """Return the cameras that C_0 becomes when it is turned rigidly about the aim point.

    Args:
        angles: (..., N) directions of the turning axes in the plate's plane, radians from x.
        distance: (...) distance of the camera from the aim point, metres.
        tilt: (...) angle of the turn, radians.
        centre: (..., 3) aim point in the target frame, metres.

    Returns:
        (..., N, 4, 4) poses target_T_camera.
    """
    angles, centre = np.asarray(angles, dtype=float), np.asarray(centre, dtype=float)
    axes = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=-1)
    R = rotations.exp(np.asarray(tilt, dtype=float)[..., None, None] * axes)
    reach = np.asarray(distance, dtype=float)[..., None, None]
    return se3.from_parts(R, centre[..., None, :] - reach * R[..., :, 2])


def generate_stations(
    count: int, distance: ArrayLike, tilt: ArrayLike, centre: ArrayLike = (0.0, 0.0, 0.0)
) -> FloatArray:
    """Return the paper's stations, section IV-A1: `count` turns of C_0, evenly about the plate.

    Args:
        count: Number of stations N.
        distance: (...) distance of the camera from the aim point, metres.
        tilt: (...) angle of the turn, radians.
        centre: (..., 3) aim point in the target frame, metres.

    Returns:
        (..., N, 4, 4) poses target_T_camera; the axis of station i lies at 360 i / N degrees.
    """
    return tilted_stations(circle_angles(count), distance, tilt, centre)


def robot_poses(
    target_T_camera: FloatArray,
    mount_T_camera: FloatArray,
    reference_T_target: FloatArray,
    setup: Setup,
) -> FloatArray:
    """Return the robot's poses that bring the camera and the target together as wanted.

    Args:
        target_T_camera: (..., 4, 4) wanted poses of the camera in the target.
        mount_T_camera: (4, 4) the camera on its mount.
        reference_T_target: (4, 4) the target on the other side.
        setup: Names mount and reference.

    Returns:
        (..., 4, 4) poses base_T_gripper.
    """
    reference_T_mount = reference_T_target @ target_T_camera @ se3.inverse(mount_T_camera)
    return reference_T_mount if setup is Setup.EYE_IN_HAND else se3.inverse(reference_T_mount)


def _motions(poses: FloatArray, pairs: IntArray | Sequence[tuple[int, int]]) -> FloatArray:
    """Return the (..., m, 3, 3) rotations from camera i to camera j, eq. (7)."""
    pairs = np.asarray(pairs, dtype=np.int64).reshape(-1, 2)
    R = poses[..., :3, :3]
    return np.asarray(np.swapaxes(R[..., pairs[:, 1], :, :], -1, -2) @ R[..., pairs[:, 0], :, :])


def interstation_angles(
    poses: FloatArray, pairs: IntArray | Sequence[tuple[int, int]]
) -> FloatArray:
    """Return the rotation angle between the two stations of each pair.

    Args:
        poses: (..., N, 4, 4) poses target_T_camera.
        pairs: (m, 2) indices of stations.

    Returns:
        (..., m) angles in [0, pi], radians.
    """
    return rotations.angle(_motions(poses, pairs))


def angles_between_axes(
    poses: FloatArray, pairs: IntArray | Sequence[tuple[int, int]]
) -> FloatArray:
    """Return the angles between the interstation rotation axes, as lines without a sense.

    This is the paper's angle between P_c12 and P_c23, section III-B, for every two pairs; the
    gripper's axes enclose the same angles.

    Args:
        poses: (..., N, 4, 4) poses target_T_camera.
        pairs: (m, 2) indices of stations whose rotations differ.

    Returns:
        (..., m, m) angles in [0, pi / 2], radians.
    """
    P = rotations.principal_axis(_motions(poses, pairs))
    first, second = P[..., :, None, :], P[..., None, :, :]
    sine = np.linalg.norm(np.cross(first, second), axis=-1)
    return np.asarray(np.arctan2(sine, np.abs(np.sum(first * second, axis=-1))))
