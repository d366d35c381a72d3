"""The calibration: what people and systems take away."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from handeye_cli.conventions import Setup
from handeye_cli.records.basics import (
    Camera,
    Finding,
    FloatArray,
    Noise,
    ProvenanceStep,
    UncertainPose,
)

if TYPE_CHECKING:
    from handeye_cli.records.bad_stations import WithoutBadStations
    from handeye_cli.records.free import FreeDirection


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
class Spread:
    """How a quantity is spread over the stations or their pairs: radians or metres."""

    median: float
    smallest: float
    largest: float


@dataclass(frozen=True)
class CriticalFactors:
    """What the accuracy depends on, section III-B of the paper, measured on one recording.

    The fourth of its factors, the noise of the stations' poses, is the calibration's `noise`.

    Attributes:
        stations: How many were used.
        axes_angle: Between the axes of interstation rotations that share a station, radians.
        interstation_angle: Rotation of an interstation pair, radians.
        camera_distance: From the camera to the middle of the target, or to its origin where the
            target's points are not at hand, metres.
        gripper_distance: Between the gripper's positions of an interstation pair, metres.
        robot_share_rotation: Part of the predicted mean square error of the rotation that is due to
            the robot's noise, 0 to 1; None where the camera's noise is unknown.
        robot_share_translation: The same of the translation.
    """

    stations: int
    axes_angle: Spread
    interstation_angle: Spread
    camera_distance: Spread
    gripper_distance: Spread
    robot_share_rotation: float | None = None
    robot_share_translation: float | None = None


@dataclass(frozen=True)
class Improvement:
    """One of the paper's steps to improve accuracy, section III-C, computed for one recording.

    Attributes:
        change: Stable short name in kebab-case.
        action: What would be done, with its numbers.
        rotation: RMS error of the answer's rotation that is to be expected then, radians.
        translation: The same of the translation, metres.
        message: The action and its effect in a sentence.
    """

    change: str
    action: str
    rotation: float
    translation: float
    message: str


@dataclass(frozen=True)
class Comparison:
    """What one method says about the stations of a calibration; None where it cannot say it.

    Attributes:
        method: A row of the table of solvers.
        rotation: Angle between its answer and that of maximum likelihood, radians.
        translation: Distance between the two, metres.
        predicted_rotation: RMS error that is expected of its answer, radians.
        predicted_translation: The same of the translation, metres.
        held_out_rotation: RMS error at stations left out one by one, radians.
        held_out_translation: The same of the translation, metres.
        reason: Why something is missing.
    """

    method: str
    rotation: float | None = None
    translation: float | None = None
    predicted_rotation: float | None = None
    predicted_translation: float | None = None
    held_out_rotation: float | None = None
    held_out_translation: float | None = None
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
        factors: What its accuracy depends on, as measured, or None where it was not.
        improvements: What would make it more accurate, each on its own, the best first.
        diagnosis: Findings about the data.
        camera: The intrinsics that were used, when there were any.
        provenance: How it came about.
        covariance_between: (6, 6) of `mount_T_camera` (rows) with `reference_T_target` (columns),
            or None when unknown.
        noise_freedom: Degrees of freedom with which the noise was estimated; None when it was
            given, or when they are unknown.
        comparison: What every method says, where that was asked for.
        without: How far the answer on all stations is from this one, where bad ones are left out.
        free: Directions of `mount_T_camera` that the data leave free: its covariance is zero along
            them, and its value is a choice; nothing where all is determined.
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
    factors: CriticalFactors | None = None
    improvements: tuple[Improvement, ...] = ()
    diagnosis: tuple[Finding, ...] = ()
    camera: Camera | None = None
    provenance: tuple[ProvenanceStep, ...] = ()
    covariance_between: FloatArray | None = None
    noise_freedom: float | None = None
    comparison: tuple[Comparison, ...] = ()
    without: WithoutBadStations | None = None
    free: tuple[FreeDirection, ...] = ()
