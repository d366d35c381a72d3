"""A recording of a target whose truth is known: noisy robot poses, pictures drawn on demand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from handeye_cli import targets
from handeye_cli.conventions import Setup
from handeye_cli.geometry import se3
from handeye_cli.geometry.camera import project
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
from handeye_cli.simulate.bowed import FLAT, Bow, bow_of, require_seen
from handeye_cli.simulate.faults import Fault, Staging, stage
from handeye_cli.simulate.poses import perturbed
from handeye_cli.simulate.render import Appearance, expose, extent_of, paint_target
from handeye_cli.targets.drawing import Drawing


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


@dataclass(frozen=True)
class Scene:
    """The camera and what is really before it, wherever the two are.

    Attributes:
        camera: The intrinsics.
        points: (n, 3) points of the target as it is printed and bent, metres.
        drawing: What is on it.
        appearance: Light, ink and lens.
        bow: How the target is bent.
    """

    camera: Camera
    points: FloatArray
    drawing: Drawing
    appearance: Appearance
    bow: Bow = FLAT

    def pixels(self, camera_T_target: FloatArray) -> FloatArray:
        """Return the (..., n, 2) images of the points, for (..., 4, 4) poses of the target."""
        seen = se3.transform_points(camera_T_target, self.points)
        return project(seen, self.camera.parameters, self.camera.model)


@dataclass(frozen=True)
class RenderedImage:
    """A picture that is drawn when it is looked at, the same each time; an `ImageSource`.

    Attributes:
        label: Name for people.
        scene: What is before the camera.
        camera_T_target: (4, 4) pose of the target.
        seed: Of the noise.
    """

    label: str
    scene: Scene
    camera_T_target: FloatArray
    seed: np.random.SeedSequence

    def load(self) -> GreyImage:
        """Draw the (height, width) grey image.

        Raises:
            UsageError: The target is not in front of the camera, or bent out of its sight.
            InputError: The distortion leaves pixels without a direction.
        """
        return self.exposed(self.light())

    def light(self) -> FloatArray:
        """Return the picture's (height, width) grey levels before noise and rounding.

        Raises:
            UsageError: The target is not in front of the camera, or bent out of its sight.
            InputError: The distortion leaves pixels without a direction.
        """
        scene, pose = self.scene, self.camera_T_target
        return paint_target(
            scene.camera, pose, scene.drawing, appearance=scene.appearance, bow=scene.bow
        )

    def exposed(self, light: FloatArray) -> GreyImage:
        """Return the picture that this light makes, which may come from one of the same pose."""
        return expose(light, self.scene.appearance.noise, np.random.default_rng(self.seed))


@dataclass(frozen=True)
class SimulatedRecording:
    """A recording with the truth it was made from.

    Attributes:
        recording: What a user would have; also those pictures that a fault leaves out.
        mount_T_camera: (4, 4) true answer.
        reference_T_target: (4, 4) true constant, until a fault moves the target.
        base_T_gripper: (N, 4, 4) true poses of the robot.
        camera_T_target: (N, 4, 4) true poses of the target.
        target_T_camera: (N, 4, 4) places of the camera before the target where it was first.
        scene: What is before the camera.
        staging: What is otherwise than declared.
        seed: Of all noise.
    """

    recording: Recording
    mount_T_camera: FloatArray
    reference_T_target: FloatArray
    base_T_gripper: FloatArray
    camera_T_target: FloatArray
    target_T_camera: FloatArray
    scene: Scene
    staging: Staging
    seed: int


def simulate_recording(
    rig: Rig,
    target_T_camera: FloatArray,
    seed: int,
    *,
    names: Sequence[str] | None = None,
    faults: Sequence[Fault] = (),
) -> SimulatedRecording:
    """Take a recording of a target from given places.

    Args:
        rig: What stays as it is over all stations.
        target_T_camera: (N, 4, 4) true places of the camera before the target where it was first.
        seed: Of all noise. A station's picture does not depend on the other stations.
        names: Of the stations; "00", "01", ... when None.
        faults: What goes wrong.

    Returns:
        The recording and the truth. Its pictures are drawn when they are looked at.

    Raises:
        InputError: The target is of an unknown type, or lacks a key.
        UsageError: A fault names a station that is not there, or bends the target out of sight.
    """
    staging = stage(names or station_names(len(target_T_camera)), faults)
    scene = _scene(rig, staging)
    X, Z = rig.mount_T_camera, rig.reference_T_target
    base_T_gripper = robot_poses(target_T_camera, X, Z, rig.setup)
    camera_T_target = se3.inverse(target_T_camera) @ target_T_moved(staging)
    require_seen(scene.bow, camera_T_target, extent_of(scene.drawing))
    told = _told(base_T_gripper, rig.noise, staging, np.random.default_rng(seed_of(seed, 0)))
    images = _images(scene, camera_T_target[staging.pictured], staging.names, seed)
    stations = tuple(map(RecordedStation, staging.names, told, images))
    return SimulatedRecording(
        recording=Recording(rig.setup, stations, rig.target, rig.camera),
        mount_T_camera=X,
        reference_T_target=Z,
        base_T_gripper=base_T_gripper,
        camera_T_target=camera_T_target,
        target_T_camera=target_T_camera,
        scene=scene,
        staging=staging,
        seed=seed,
    )


def seed_of(seed: int, *key: int) -> np.random.SeedSequence:
    """Return the source of one part of the noise: 0 the robot's, 1 + k that of picture k."""
    return np.random.SeedSequence(seed, spawn_key=key)


def target_T_moved(staging: Staging) -> FloatArray:
    """Return the (N, 4, 4) poses of the target in the place where it was first."""
    return se3.from_parts(np.eye(3), staging.target_shift)


def _scene(rig: Rig, staging: Staging) -> Scene:
    board = targets.build(_printed(rig.target, staging.print_scale))
    bow = bow_of(board.points(), staging.bow)
    bent = bow.lifted(board.points()[:, :2])
    return Scene(rig.camera, bent, board.drawing(), rig.appearance, bow)


def _printed(target: TargetSpec, scale: float) -> TargetSpec:
    """Return a target with all its lengths scaled."""
    lengths = {
        key: value * scale
        for key, value in target.parameters.items()
        if key.endswith("_mm") and isinstance(value, float | int)
    }
    return target if scale == 1.0 else TargetSpec(target.type, {**target.parameters, **lengths})


def _images(
    scene: Scene, camera_T_target: FloatArray, names: Sequence[str], seed: int
) -> list[RenderedImage]:
    return [
        RenderedImage(f"images/{name}.png", scene, pose, seed_of(seed, 1 + k))
        for k, (name, pose) in enumerate(zip(names, camera_T_target, strict=True))
    ]


def _told(
    base_T_gripper: FloatArray, noise: Noise, staging: Staging, rng: np.random.Generator
) -> FloatArray:
    """Return the (N, 4, 4) poses that the robot tells."""
    scaled = se3.from_parts(
        base_T_gripper[:, :3, :3], staging.robot_scale * base_T_gripper[:, :3, 3]
    )
    return perturbed(scaled, noise.robot_rotation, noise.robot_translation, rng)
