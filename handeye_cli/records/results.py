"""Calibration, verification and plan: what people and systems take away."""

from __future__ import annotations

from dataclasses import dataclass

from handeye_cli.conventions import Setup
from handeye_cli.records.basics import (
    Camera,
    Finding,
    FloatArray,
    Noise,
    ProvenanceStep,
    UncertainPose,
)


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
