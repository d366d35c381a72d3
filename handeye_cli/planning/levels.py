"""Which noise a plan is predicted with: what the user states, a calibration's, or the paper's."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handeye_cli.conventions import MIL, MRAD, Setup
from handeye_cli.errors import UsageError
from handeye_cli.geometry import se3
from handeye_cli.geometry.loop import isotropic_covariance
from handeye_cli.planning.cell import Frames
from handeye_cli.planning.options import PlanOptions
from handeye_cli.planning.prediction import UncertainRig, directions
from handeye_cli.records import Camera, FloatArray, Noise
from handeye_cli.records.planning import PlanBasis
from handeye_cli.sight import Sight

PAPERS_NOISE = Noise(
    robot_rotation=1.5 * MRAD,
    robot_translation=5.0 * MIL,
    camera_rotation=1.5 * MRAD,
    camera_translation=3.0 * MIL,
)
"""The levels of the paper's simulations, section IV-A2."""
ROBOT_LEVELS = ("robot_rotation", "robot_translation")
CAMERA_LEVELS = ("camera_rotation", "camera_translation")
_FLOOR = 1e-9
"""Smallest level considered, radians and metres."""


@dataclass(frozen=True)
class Supposed:
    """What a plan is predicted with.

    Attributes:
        rig: Robot, camera and noise.
        noise: Its levels.
        basis: Where they come from.
    """

    rig: UncertainRig
    noise: Noise
    basis: PlanBasis


def suppose(frames: Frames, options: PlanOptions) -> Supposed:
    """Return what a plan is to be predicted with: what is stated, then what is known.

    Args:
        frames: Guesses of where camera and target are.
        options: What the user states, and an earlier calibration's noise.

    Raises:
        UsageError: The noise of the pixels is stated, but not what the camera sees.
    """
    robot, robot_from = _levels(options, ROBOT_LEVELS)
    camera, camera_from = _camera_levels(options)
    noise = replace(camera, robot_rotation=robot[0], robot_translation=robot[1])
    X, Z, lever = _versions(frames, options.lever)
    rig = UncertainRig(
        frames.setup,
        X,
        Z,
        isotropic_covariance(max(robot[0], _FLOOR), max(robot[1], _FLOOR)),
        camera_covariance(camera, options.points, options.camera),
    )
    mount = "calibration" if lever is None else "lever"
    return Supposed(rig, noise, PlanBasis(robot_from, camera_from, mount, lever))


def camera_covariance(
    noise: Noise, points: FloatArray | None, camera: Camera | None
) -> FloatArray | Sight:
    """Return how the noise of camera_T_target follows from levels of the camera.

    Args:
        noise: Levels; those of the pose win over that of the pixels.
        points: (n, 3) points of the target, or None.
        camera: The intrinsics, or None.
    """
    levels = noise.camera_rotation, noise.camera_translation
    if noise.pixel is None or levels != (None, None) or points is None or camera is None:
        return isotropic_covariance(*(max(level or 0.0, _FLOOR) for level in levels))
    everything = np.ones((1, len(points)), dtype=bool)
    return Sight(points, everything, camera, np.array([max(noise.pixel, _FLOOR)]))


def _levels(options: PlanOptions, names: tuple[str, str]) -> tuple[list[float], str]:
    """Return the levels of these names, and where they come from.

    What a calibration does not know of the camera, it has put down to the robot: that is 0.
    """
    known, source = options.known, "calibration"
    if known is None or all(
        getattr(known, name) is None for name in (*ROBOT_LEVELS, *CAMERA_LEVELS)
    ):
        known, source = PAPERS_NOISE, "paper"
    stated = [getattr(options.given, name) for name in names]
    rest = [getattr(known, name) or 0.0 for name in names]
    levels = [b if a is None else a for a, b in zip(stated, rest, strict=True)]
    return levels, source_of(options.given, names, source)


def source_of(given: Noise, names: tuple[str, str], otherwise: str) -> str:
    """Return what to call the source of two levels: `given` where both of them are stated."""
    stated = [getattr(given, name) for name in names]
    return otherwise if None in stated else "given"


def _camera_levels(options: PlanOptions) -> tuple[Noise, str]:
    given, known = options.given, options.known
    sees = options.points is not None and options.camera is not None
    if given.pixel is not None and not sees:
        raise UsageError(
            f"the noise of the pixels, {given.pixel:g} px, needs to know what the camera sees",
            hint="give --target, and --camera or a --calibration with intrinsics",
        )
    if given.camera_rotation is None and given.camera_translation is None and sees:
        pixel = given.pixel if known is None or given.pixel is not None else known.pixel
        if pixel is not None:
            return Noise(pixel=pixel), "pixels"
    levels, source = _levels(options, CAMERA_LEVELS)
    return Noise(camera_rotation=levels[0], camera_translation=levels[1]), source


def _versions(frames: Frames, lever: float) -> tuple[FloatArray, FloatArray, float | None]:
    """Return (D, 4, 4) X and Z, and the lever where its directions are what the versions are.

    Turning the gripper's or the base's frame changes no error; so, without a guess, one vector
    matters: from the gripper to the camera, or to the target where that is in the gripper.
    """
    X, Z = frames.mount_T_camera, frames.reference_T_target
    in_hand = frames.setup is Setup.EYE_IN_HAND
    unknown = X is None if in_hand else Z is None
    origin = np.eye(4)[None]
    if not unknown:
        return origin if X is None else X[None], origin if Z is None else Z[None], None
    levers = se3.from_parts(np.eye(3), lever * directions())
    still = np.broadcast_to(origin, levers.shape)
    return (levers, still, lever) if in_hand else (still, levers, lever)
