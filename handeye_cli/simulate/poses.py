"""Noisy measurements of stations, as many trials at once as are wanted."""

from __future__ import annotations

import math

import numpy as np

from handeye_cli.geometry import se3
from handeye_cli.records import FloatArray, Noise


def perturbed(
    poses: FloatArray,
    rotation: float | None,
    translation: float | None,
    rng: np.random.Generator,
    trials: tuple[int, ...] = (),
) -> FloatArray:
    """Return poses with independent Gaussian errors in their parent frame.

    Args:
        poses: (..., 4, 4) true poses.
        rotation: RMS angle of the error, radians; each axis has a share of 1 / sqrt(3). None is 0.
        translation: RMS distance of the error, metres, likewise.
        rng: Source of the errors.
        trials: Shape of the leading axes to repeat all poses over.

    Returns:
        (*trials, ..., 4, 4) poses.
    """
    sigma = np.repeat([translation or 0.0, rotation or 0.0], 3) / math.sqrt(3.0)
    return se3.perturb(poses, sigma * rng.standard_normal((*trials, *poses.shape[:-2], 6)))


def noisy_stations(
    base_T_gripper: FloatArray,
    camera_T_target: FloatArray,
    noise: Noise,
    trials: int,
    rng: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    """Return what robot and camera might have measured, again and again.

    Args:
        base_T_gripper: (N, 4, 4) true poses of the robot.
        camera_T_target: (N, 4, 4) true poses of the target.
        noise: RMS magnitudes of the errors of both; None is 0, `pixel` is not used.
        trials: Number of repetitions.
        rng: Source of the errors.

    Returns:
        (trials, N, 4, 4) poses base_T_gripper and as many camera_T_target.
    """
    return (
        perturbed(base_T_gripper, noise.robot_rotation, noise.robot_translation, rng, (trials,)),
        perturbed(camera_T_target, noise.camera_rotation, noise.camera_translation, rng, (trials,)),
    )
