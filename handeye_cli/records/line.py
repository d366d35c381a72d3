"""Recording, features and stations: a station on its way from a picture to a pose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from handeye_cli.conventions import QuaternionOrder, RobotPoses, Setup
from handeye_cli.records.basics import (
    Camera,
    Finding,
    FloatArray,
    GreyImage,
    IntArray,
    Noise,
    ProvenanceStep,
    TargetSpec,
    UncertainPose,
)

if TYPE_CHECKING:
    from handeye_cli.records.frames import RobotFrames
    from handeye_cli.records.moving import MovingFrames


class ImageSource(Protocol):
    """Where the picture of a station comes from; loaded only when it is looked at."""

    @property
    def label(self) -> str:
        """Name for people: the path, or the topic and time."""

    def load(self) -> GreyImage:
        """Return the (height, width) grey image.

        Raises:
            InputError: It cannot be read or is no image.
        """


@dataclass(frozen=True)
class WrittenRotation:
    """How the rotation of a robot's pose stood in its document, where the pose does not show it.

    Attributes:
        robot_poses: Direction of the pose as it was read: `base_T_gripper` or its inverse.
        quaternion_order: Order in which quaternions were read.
        euler: The three Euler angles as written, or None when it was given in another form.
        order: Their axes, as `matrix_from_euler` takes them.
        degrees: Whether they were read as degrees.
    """

    robot_poses: RobotPoses = RobotPoses.GRIPPER_IN_BASE
    quaternion_order: QuaternionOrder = QuaternionOrder.XYZW
    euler: tuple[float, float, float] | None = None
    order: str = ""
    degrees: bool = False


@dataclass(frozen=True)
class RecordedStation:
    """A pause of the robot with a picture, or a frame in motion where it never pauses.

    Attributes:
        name: Name of the station.
        base_T_gripper: (4, 4) pose from the robot's controller.
        image: The picture.
        written: How that pose was written, or None for the default form.
    """

    name: str
    base_T_gripper: FloatArray
    image: ImageSource
    written: WrittenRotation | None = None


@dataclass(frozen=True)
class Observation:
    """Target points seen in one image.

    Attributes:
        ids: (n,) indices of the target's points.
        pixels: (n, 2) images of these points, in pixels.
        sigma_px: Standard deviation of one coordinate, or None when the detector cannot tell.
    """

    ids: IntArray
    pixels: FloatArray
    sigma_px: float | None = None


@dataclass(frozen=True)
class Station:
    """A station on its way from pixels to poses.

    Attributes:
        name: Name of the station.
        base_T_gripper: (4, 4) pose from the robot's controller.
        observation: What was seen, or None.
        camera_T_target: Pose of the target in the camera, or None when unknown.
        reason: Why the station cannot be used, or None.
        written: How the robot's pose was written, or None for the default form.
        robot_covariance: (6, 6) of `base_T_gripper` beside the robot's own noise, or None: what the
            scatter of the images' times adds to it while the robot moves.
        shared_error: (6,) by how much `base_T_gripper` is off where all stations are off by one
            standard deviation of an error that they share, or None: what the uncertainty of the
            time between images and poses makes of the robot's velocity.
    """

    name: str
    base_T_gripper: FloatArray
    observation: Observation | None = None
    camera_T_target: UncertainPose | None = None
    reason: str | None = None
    written: WrittenRotation | None = None
    robot_covariance: FloatArray | None = None
    shared_error: FloatArray | None = None


@dataclass(frozen=True)
class Recording:
    """Images and robot poses, as they were taken.

    Robots' recordings only know `moving`, and `frames`, which says what the robot calls its own.
    """

    setup: Setup
    stations: tuple[RecordedStation, ...]
    target: TargetSpec | None = None
    camera: Camera | None = None
    noise: Noise | None = None
    findings: tuple[Finding, ...] = ()
    provenance: tuple[ProvenanceStep, ...] = ()
    moving: MovingFrames | None = None
    frames: RobotFrames | None = None


@dataclass(frozen=True)
class Features:
    """Target points found in the images; every station is kept, found or not.

    `image_size` is (width, height) in pixels; a calibration of the intrinsics starts from it.
    """

    setup: Setup
    stations: tuple[Station, ...]
    target: TargetSpec
    camera: Camera | None = None
    image_size: tuple[int, int] | None = None
    noise: Noise | None = None
    findings: tuple[Finding, ...] = ()
    provenance: tuple[ProvenanceStep, ...] = ()


@dataclass(frozen=True)
class Stations:
    """Robot poses and target poses, with the pixels they come from where there are any."""

    setup: Setup
    stations: tuple[Station, ...]
    target: TargetSpec | None = None
    camera: Camera | None = None
    noise: Noise | None = None
    findings: tuple[Finding, ...] = ()
    provenance: tuple[ProvenanceStep, ...] = ()
