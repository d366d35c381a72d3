"""What flows along the line: recording -> features -> stations -> calibration -> verification.

Frozen, with arrays in float64, metres and radians. A pose is a 4x4 homogeneous matrix. Covariances
are 6x6 in the order (x, y, z, rx, ry, rz), of a perturbation in the parent frame: `t + dt`,
`Exp(dr) R`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from handeye_cli.conventions import Setup

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
GreyImage = NDArray[np.uint8]


@dataclass(frozen=True)
class UncertainPose:
    """A pose and, where it is known, its covariance.

    Attributes:
        matrix: (4, 4) homogeneous transform.
        covariance: (6, 6), or None when unknown.
    """

    matrix: FloatArray
    covariance: FloatArray | None = None


@dataclass(frozen=True)
class Camera:
    """Intrinsics of a camera, pixel (0, 0) being the centre of the top-left pixel.

    Attributes:
        width: Image width in pixels.
        height: Image height in pixels.
        fx: Focal length along x in pixels.
        fy: Focal length along y in pixels.
        cx: Principal point x in pixels.
        cy: Principal point y in pixels.
        distortion: Coefficients in OpenCV's order for the model.
        model: `plumb_bob`, `rational_polynomial` or `equidistant`, as in ROS.
        covariance: (4 + k, 4 + k) of (fx, fy, cx, cy, *distortion), or None when taken as exact.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()
    model: str = "plumb_bob"
    covariance: FloatArray | None = None

    @property
    def parameters(self) -> FloatArray:
        """(4 + k,) array of fx, fy, cx, cy and the distortion."""
        return np.array([self.fx, self.fy, self.cx, self.cy, *self.distortion])


@dataclass(frozen=True)
class TargetSpec:
    """What the calibration target is, as a document or `--target` says it.

    Attributes:
        type: A row of the table of targets, such as `disc-grid`.
        parameters: The keys of that type, with their units in their names.
    """

    type: str
    parameters: Mapping[str, float | int | str | bool] = field(default_factory=dict)


@dataclass(frozen=True)
class Noise:
    """Noise levels as RMS magnitudes; None where unknown.

    Attributes:
        robot_rotation: Of `base_T_gripper`, radians.
        robot_translation: Of `base_T_gripper`, metres.
        camera_rotation: Of `camera_T_target`, radians.
        camera_translation: Of `camera_T_target`, metres.
        pixel: Of one image coordinate, pixels (a standard deviation, not a magnitude).
    """

    robot_rotation: float | None = None
    robot_translation: float | None = None
    camera_rotation: float | None = None
    camera_translation: float | None = None
    pixel: float | None = None


@dataclass(frozen=True)
class ProvenanceStep:
    """One command that led to a document.

    Attributes:
        command: Such as `solve`.
        version: Version of the tool.
        inputs: Pairs of file name and SHA-256 in hex.
        options: The flags that were given.
    """

    command: str
    version: str
    inputs: tuple[tuple[str, str], ...] = ()
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Finding:
    """Something the user should know about the data.

    Attributes:
        code: Stable short name in kebab-case.
        severity: `info`, `warning` or `error`.
        message: What was seen, with numbers.
        advice: The next step.
    """

    code: str
    severity: str
    message: str
    advice: str = ""


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
class RecordedStation:
    """A pause of the robot with a picture.

    Attributes:
        name: Name of the station.
        base_T_gripper: (4, 4) pose from the robot's controller.
        image: The picture.
    """

    name: str
    base_T_gripper: FloatArray
    image: ImageSource


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
    """

    name: str
    base_T_gripper: FloatArray
    observation: Observation | None = None
    camera_T_target: UncertainPose | None = None
    reason: str | None = None


@dataclass(frozen=True)
class Recording:
    """Images and robot poses, as they were taken."""

    setup: Setup
    stations: tuple[RecordedStation, ...]
    target: TargetSpec | None = None
    camera: Camera | None = None
    noise: Noise | None = None
    findings: tuple[Finding, ...] = ()
    provenance: tuple[ProvenanceStep, ...] = ()


@dataclass(frozen=True)
class Features:
    """Target points found in the images; every station is kept, found or not."""

    setup: Setup
    stations: tuple[Station, ...]
    target: TargetSpec
    camera: Camera | None = None
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


@dataclass(frozen=True)
class PaperPrediction:
    """The error the paper's formulas (28)-(33) predict for the answer, as RMS and as maximum.

    Attributes:
        rotation: Eq. (29), radians.
        translation: Eq. (31), an upper bound, metres.
        rotation_max: Eq. (30), radians.
        translation_max: Eq. (33), metres.
    """

    rotation: float
    translation: float
    rotation_max: float
    translation_max: float


@dataclass(frozen=True)
class PredictedError:
    """How far from the truth the answer is expected to be.

    Attributes:
        rotation: RMS angle, radians.
        translation: RMS distance, metres.
        rotation_95: 95 % of answers are at least this near, radians.
        translation_95: The same for the translation, metres.
        paper: The paper's own prediction, or None where its formulas do not apply.
    """

    rotation: float
    translation: float
    rotation_95: float
    translation_95: float
    paper: PaperPrediction | None = None


@dataclass(frozen=True)
class StationResidual:
    """How far one station is from the solution; residuals are None for an unused station.

    Attributes:
        name: Name of the station.
        used: Whether it took part in the solution.
        rotation: Angle between the target as this station sees it and as all do, radians.
        translation: Distance between the two, metres.
        reason: Why it was not used.
    """

    name: str
    used: bool
    rotation: float | None = None
    translation: float | None = None
    reason: str | None = None


@dataclass(frozen=True)
class Calibration:
    """The answer: where the camera sits on its mount, and how sure that is.

    Attributes:
        setup: Names the frames of the two poses.
        method: A row of the table of solvers.
        mount_T_camera: `gripper_T_camera`, or `base_T_camera` for eye-to-hand.
        reference_T_target: `base_T_target`, or `gripper_T_target` for eye-to-hand.
        predicted_error: Expected error of `mount_T_camera`.
        noise: The levels the prediction rests on.
        noise_estimated: True where they were estimated from the residuals.
        stations: One residual for each station of the input.
        pairs: Interstation pairs (i, j) by index into `stations`, for methods that use pairs.
        diagnosis: Findings about the data.
        camera: The intrinsics that were used, when there were any.
        provenance: How it came about.
    """

    setup: Setup
    method: str
    mount_T_camera: UncertainPose
    reference_T_target: UncertainPose
    predicted_error: PredictedError
    noise: Noise
    noise_estimated: bool
    stations: tuple[StationResidual, ...]
    pairs: tuple[tuple[int, int], ...] = ()
    diagnosis: tuple[Finding, ...] = ()
    camera: Camera | None = None
    provenance: tuple[ProvenanceStep, ...] = ()


@dataclass(frozen=True)
class StationError:
    """Error of the camera pose predicted for one verification station.

    Attributes:
        name: Name of the station.
        rotation: Radians.
        translation: Metres.
    """

    name: str
    rotation: float
    translation: float


@dataclass(frozen=True)
class VerificationRow:
    """One line of the paper's table: calibrated on N stations, verified on others.

    Attributes:
        stations: N, the number of stations calibrated on.
        rotation: RMS rotation error over the verification stations, radians.
        translation: RMS distance error over them, metres.
        predicted_rotation: What the covariances predict for it, radians, or None.
        predicted_translation: The same, metres, or None.
        consistent: Whether seen and predicted agree within chance, or None when not judged.
        errors: Each verification station's own errors.
    """

    stations: int
    rotation: float
    translation: float
    predicted_rotation: float | None
    predicted_translation: float | None
    consistent: bool | None
    errors: tuple[StationError, ...]


@dataclass(frozen=True)
class Verification:
    """Held-out errors of a calibration."""

    setup: Setup
    method: str
    rows: tuple[VerificationRow, ...]
    diagnosis: tuple[Finding, ...] = ()
    provenance: tuple[ProvenanceStep, ...] = ()


@dataclass(frozen=True)
class PlannedStation:
    """A station to go to.

    Attributes:
        name: Name of the station.
        target_T_camera: (4, 4) pose of the camera in the target.
        base_T_gripper: (4, 4) pose for the robot, when a guess of the calibration is known.
        purpose: `calibrate` or `verify`.
    """

    name: str
    target_T_camera: FloatArray
    base_T_gripper: FloatArray | None = None
    purpose: str = "calibrate"


@dataclass(frozen=True)
class Plan:
    """Stations to visit, and the pairs the closed form will use."""

    setup: Setup
    stations: tuple[PlannedStation, ...]
    pairs: tuple[tuple[int, int], ...]
    predicted_error: PredictedError | None = None
    noise: Noise | None = None
    diagnosis: tuple[Finding, ...] = ()
    provenance: tuple[ProvenanceStep, ...] = ()
