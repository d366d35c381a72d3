"""A recording of a target whose truth is known: noisy robot poses, pictures drawn on demand."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from handeye_cli import targets
from handeye_cli.conventions import Setup
from handeye_cli.geometry import se3
from handeye_cli.geometry.station_generator import robot_poses
from handeye_cli.plan import station_names
from handeye_cli.records import (
    Camera,
    FloatArray,
    GreyImage,
    Noise,
    RecordedStation,
    Recording,
    TargetSpec,
)
from handeye_cli.simulate.poses import perturbed
from handeye_cli.simulate.render import Appearance, render_target
from handeye_cli.targets.drawing import Drawing


@dataclass(frozen=True)
class RenderedImage:
    """A picture that is drawn when it is looked at, the same each time; an `ImageSource`.

    Attributes:
        label: Name for people.
        camera: The intrinsics.
        camera_T_target: (4, 4) pose of the target.
        drawing: What is on it.
        appearance: Light, ink and lens.
        seed: Of the noise.
    """

    label: str
    camera: Camera
    camera_T_target: FloatArray
    drawing: Drawing
    appearance: Appearance
    seed: np.random.SeedSequence

    def load(self) -> GreyImage:
        """Draw the (height, width) grey image.

        Raises:
            UsageError: The target is not in front of the camera.
            InputError: The distortion leaves pixels without a direction.
        """
        return render_target(
            self.camera,
            self.camera_T_target,
            self.drawing,
            appearance=self.appearance,
            rng=np.random.default_rng(self.seed),
        )


@dataclass(frozen=True)
class SimulatedRecording:
    """A recording with the truth it was made from.

    Attributes:
        recording: What a user would have.
        mount_T_camera: (4, 4) true answer.
        reference_T_target: (4, 4) true constant.
        base_T_gripper: (N, 4, 4) true poses of the robot.
        camera_T_target: (N, 4, 4) true poses of the target.
    """

    recording: Recording
    mount_T_camera: FloatArray
    reference_T_target: FloatArray
    base_T_gripper: FloatArray
    camera_T_target: FloatArray


@dataclass(frozen=True)
class Rig:
    """What stays as it is over all stations.

    Attributes:
        target: What is seen, of any type.
        camera: Its intrinsics.
        mount_T_camera: (4, 4) the camera on its mount.
        reference_T_target: (4, 4) the target on the other side.
        setup: Names mount and reference.
        noise: Of the robot, RMS magnitudes; None is 0. The image's noise belongs to `appearance`.
        appearance: Light, ink and lens.
    """

    target: TargetSpec
    camera: Camera
    mount_T_camera: FloatArray
    reference_T_target: FloatArray
    setup: Setup = Setup.EYE_IN_HAND
    noise: Noise = field(default_factory=Noise)
    appearance: Appearance = field(default_factory=Appearance)


def simulate_recording(rig: Rig, target_T_camera: FloatArray, seed: int) -> SimulatedRecording:
    """Take a recording of a target from given places.

    Args:
        rig: What stays as it is over all stations.
        target_T_camera: (N, 4, 4) true places of the camera.
        seed: Of all noise. A station's picture does not depend on the other stations.

    Returns:
        The recording and the truth. Its pictures are drawn when they are looked at, one at a time.

    Raises:
        InputError: The target is of an unknown type, or lacks a key.
    """
    robot_seed, *image_seeds = np.random.SeedSequence(seed).spawn(len(target_T_camera) + 1)
    X, Z = rig.mount_T_camera, rig.reference_T_target
    base_T_gripper = robot_poses(target_T_camera, X, Z, rig.setup)
    noise, rng = rig.noise, np.random.default_rng(robot_seed)
    measured = perturbed(base_T_gripper, noise.robot_rotation, noise.robot_translation, rng)
    camera_T_target = se3.inverse(target_T_camera)
    images = _images(rig, camera_T_target, image_seeds)
    names = station_names(len(measured))
    stations = tuple(map(RecordedStation, names, measured, images))
    recording = Recording(rig.setup, stations, rig.target, rig.camera)
    return SimulatedRecording(recording, X, Z, base_T_gripper, camera_T_target)


def _images(
    rig: Rig, camera_T_target: FloatArray, seeds: list[np.random.SeedSequence]
) -> list[RenderedImage]:
    drawing = targets.build(rig.target).drawing()
    return [
        RenderedImage(f"images/{name}.png", rig.camera, pose, drawing, rig.appearance, seed)
        for name, pose, seed in zip(station_names(len(seeds)), camera_T_target, seeds, strict=True)
    ]
