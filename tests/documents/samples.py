"""Records of every kind with awkward values, and how to tell whether two records are the same."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from handeye_cli.conventions import QuaternionOrder, RobotPoses, Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.images import ImageFile
from handeye_cli.records import (
    BlameShares,
    Calibration,
    Camera,
    Comparison,
    CriticalFactors,
    Features,
    Finding,
    FreeDirection,
    HypothesisFit,
    Improvement,
    Inspection,
    LengthRatio,
    Noise,
    Observation,
    PaperPrediction,
    Plan,
    PlannedStation,
    PosePart,
    PredictedError,
    Protocol,
    ProvenanceStep,
    RecordedStation,
    Recording,
    SmoothResiduals,
    Spread,
    Station,
    StationError,
    StationResidual,
    Stations,
    TargetSpec,
    UncertainPose,
    Verification,
    VerificationRow,
    WithoutBadStations,
)
from handeye_cli.records.line import WrittenRotation
from handeye_cli.records.moving import TimeOffset
from handeye_cli.records.planning import CircleError, Gain, MovedStation, PlanBasis
from handeye_cli.records.recording_summary import (
    LinkSummary,
    MissingFlag,
    Motion,
    PauseSummary,
    RecordingSummary,
    TopicSummary,
    UsedParts,
)

COMPARISON = (
    Comparison("maximum-likelihood", 0.0, 0.0, 8.1e-4, 1.9e-4, 9.3e-4, 2.7e-4),
    Comparison("li", 1e-4, 2e-5, 9e-4, 2e-4, reason='no held-out error: leaving out station "01"'),
    Comparison("andreff", reason="expected rotations about two different axes"),
)


def pose(rng: np.random.Generator) -> np.ndarray:
    return se3.from_parts(rotations.exp(rng.normal(size=3)), rng.normal(size=3))


WRITTEN = WrittenRotation(
    RobotPoses.BASE_IN_GRIPPER, QuaternionOrder.WXYZ, (179.9, 1 / 3, -12.5), "ZYX", True
)


def as_euler(written: WrittenRotation) -> np.ndarray:
    """The pose that was written with these Euler angles."""
    turn = Rotation.from_euler(written.order, written.euler, degrees=written.degrees)
    inverse = written.robot_poses is RobotPoses.BASE_IN_GRIPPER
    return se3.from_parts((turn.inv() if inverse else turn).as_matrix(), np.ones(3))


def covariance(rng: np.random.Generator, size: int = 6) -> np.ndarray:
    factor = 1e-3 * rng.normal(size=(size, size))
    product = factor @ factor.T
    return 0.5 * (product + product.T)


def uncertain(rng: np.random.Generator) -> UncertainPose:
    return UncertainPose(pose(rng), covariance(rng))


def camera(rng: np.random.Generator) -> Camera:
    return Camera(
        640,
        480,
        550.1,
        551.3,
        1 / 3,
        240.0,
        (0.1, -2e-7, 0.0),
        "rational_polynomial",
        covariance(rng, 7),
    )


TARGET = TargetSpec(
    "disc-grid", {"rows": 6, "columns": 6, "spacing_mm": 25.4, "diameter_mm": 0.1 + 0.2, "on": True}
)
FINDINGS = (
    Finding("one-bad-station", "warning", "station 03: 12 mrad off, \u00b0 and: #", "leave it out"),
    Finding("few-stations", "info", "only 3"),
)
FREE = (FreeDirection(PosePart.TRANSLATION, np.array([0.6, 0.0, 0.8]), "base", "along z"),)
FACTORS = CriticalFactors(  # angles that come back from degrees to the last bit
    stations=12,
    axes_angle=Spread(1.0, 0.25, np.pi / 2),
    interstation_angle=Spread(0.75, 0.0, np.pi),
    camera_distance=Spread(1 / 3, 0.1 + 0.2, 2**0.5),
    gripper_distance=Spread(0.41, 1e-300, 123.456),
    robot_share_rotation=1 / 3,
    robot_share_translation=1.0,
)
IMPROVEMENTS = (
    Improvement(
        "nearer", "going nearer: 410 mm", 2**0.5 / 1000, 1e-300, "would help, # and \u00b0"
    ),
    Improvement("more-stations", "3 more", 0.0, 1 / 3, "would help too"),
)
PROVENANCE = (
    ProvenanceStep(
        "extrinsics",
        "0.1.0",
        (("no.mcap", "0a" * 32), ("-", "ff" * 32)),
        {"seed": 2, "tilt_mrad": 0.1, "method": "no", "flags": ["a", None, True], "empty": {}},
    ),
)
NOISE = Noise(0.0015, 7.62e-5, 1 / 3000, 1e-4, 0.02)
PREDICTION = PredictedError(
    0.00081, 0.00019, 2**0.5 / 1000, 1e-300, PaperPrediction(1e-3, 0.0, 5e-324, 123.456)
)
LINE = {"noise": NOISE, "findings": FINDINGS, "provenance": PROVENANCE}


def recording(rng: np.random.Generator, folder: Path) -> Recording:
    images = [
        ImageFile((folder / f"images/{k}.png").resolve(), f"images/{k}.png") for k in range(3)
    ]
    stations = tuple(RecordedStation(f"0{k}", pose(rng), image) for k, image in enumerate(images))
    stations += (RecordedStation("03", as_euler(WRITTEN), images[0], WRITTEN),)
    return Recording(Setup.EYE_TO_HAND, stations, TARGET, **(LINE | {"camera": camera(rng)}))


def features(rng: np.random.Generator) -> Features:
    seen = Observation(np.arange(4), 640.0 * rng.random((4, 2)), 0.02)
    stations = (
        Station("no", pose(rng), seen),
        Station("1e5", pose(rng), Observation(np.array([7]), rng.random((1, 2)))),
        Station("02", as_euler(WRITTEN), reason="31 of 36 discs: the left is cut", written=WRITTEN),
        Station("a: b", pose(rng), Observation(np.arange(0), np.empty((0, 2))), reason="too few"),
    )
    moved = {"robot_covariance": covariance(rng, 6), "shared_error": 1e-3 * rng.normal(size=6)}
    stations = (replace(stations[0], **moved), *stations[1:])
    line = LINE | {"camera": camera(rng), "image_size": (640, 480)}
    return Features(Setup.EYE_IN_HAND, stations, TARGET, **line)


def stations(rng: np.random.Generator) -> Stations:
    entries = [
        Station(
            name=f"{k:02d}",
            base_T_gripper=pose(rng),
            observation=Observation(np.arange(5), 640.0 * rng.random((5, 2)), 0.05),
            camera_T_target=uncertain(rng),
        )
        for k in range(3)
    ]
    entries += [Station("x", pose(rng), camera_T_target=UncertainPose(pose(rng)))]
    entries += [Station("y", pose(rng), reason="not found")]
    inverse = WrittenRotation(RobotPoses.BASE_IN_GRIPPER)
    entries += [Station("z", pose(rng), reason="not found", written=inverse)]
    moved = {"robot_covariance": covariance(rng, 6), "shared_error": 1e-3 * rng.normal(size=6)}
    entries += [Station("l", pose(rng), reason="late", **moved)]
    line = LINE | {"camera": camera(rng), "target": TARGET}
    return Stations(Setup.EYE_IN_HAND, tuple(entries), **line)


def calibration(rng: np.random.Generator, setup: Setup = Setup.EYE_IN_HAND) -> Calibration:
    residuals = (
        StationResidual("00", True, 1e-3 * rng.random(), 1e-3 * rng.random()),
        StationResidual("01", True, 0.0, 1e-9),
        StationResidual("02", False, reason="the plate was not found"),
    )
    joint = covariance(rng, 12)
    return Calibration(
        setup=setup,
        method="maximum-likelihood",
        mount_T_camera=UncertainPose(pose(rng), joint[:6, :6]),
        reference_T_target=UncertainPose(pose(rng), joint[6:, 6:]),
        predicted_error=PREDICTION,
        noise=NOISE,
        noise_estimated=False,
        stations=residuals,
        pairs=((0, 1), (1, 2)),
        factors=FACTORS,
        improvements=IMPROVEMENTS,
        comparison=COMPARISON,
        without=WithoutBadStations(("01",), 1 / 3000, 1e-4),
        free=FREE,
        diagnosis=FINDINGS,
        camera=camera(rng),
        provenance=PROVENANCE,
        covariance_between=joint[:6, 6:],
        noise_freedom=17.3,
    )


def verification(rng: np.random.Generator) -> Verification:
    errors = tuple(StationError(f"0{k}", *(1e-3 * rng.random(4)).tolist()) for k in range(4))
    rows = (
        VerificationRow(4, 4.568e-3, 5.9e-4, 3e-3, 2e-4, True, errors, 0.7, 1 / 3000),
        VerificationRow(6, 3.304e-3, 4.8e-4, None, None, None, ()),
    )
    return Verification(
        Setup.EYE_IN_HAND, "tsai-lenz", rows, FINDINGS, PROVENANCE, Protocol.LEAVE_ONE_OUT
    )


def plan(rng: np.random.Generator) -> Plan:
    visited = (
        PlannedStation("00", pose(rng), pose(rng)),
        PlannedStation("01", pose(rng), purpose="verify"),
    )
    return Plan(
        Setup.EYE_TO_HAND,
        visited,
        ((0, 1),),
        PREDICTION,
        Noise(pixel=0.1),
        FINDINGS,
        PROVENANCE,
        basis=PlanBasis("paper", "pixels", "lever", 0.2413),
        circle=CircleError(1.7e-3, 3.1e-4, False),
        moved=(MovedStation("00", ("view",), 0.3, 0.01),),
        gains=(Gain("00", 8e-4, 2e-4, 6e-4, 1e-4),),
        order=("01", "00"),
    )


def inspection(rng: np.random.Generator) -> Inspection:
    shares = {
        f"{cause}_{part}": float(rng.random())
        for cause in ("robot", "camera", "intrinsics", "plate", "timing")
        for part in ("rotation", "translation")
    }
    return Inspection(
        setup=Setup.EYE_TO_HAND,
        stations=(
            StationResidual("00", True, 1e-3, 1 / 3),
            StationResidual("b", False, reason="?"),
        ),
        diagnosis=FINDINGS,
        hypotheses=(
            HypothesisFit("declared", "as declared", "", 0.3, 0.1),
            HypothesisFit("pose-units", "in mm", "--pose-units mm", 1e-3, 1e-4),
        ),
        length_ratio=LengthRatio(1.27, 1e-3),
        time_offset=TimeOffset(-1 / 30, 2e-4, 1e-3, 47, given=0.01),
        free=FREE,
        predicted_error=PREDICTION,
        surfaces=SmoothResiduals(0.13, 0.05, 1e-3, 1e-4, -1e-3, 1e-5, 2e-3, 2e-5, 0.6, 0.2),
        blame=BlameShares(
            1e-3,
            4e-4,
            limit="robot",
            words="robot 0.1 mrad and 0.4 mm, camera 0.02 mrad and 0.1 mm",
            **shares,
        ),
        recording=RecordingSummary(
            duration=12.5,
            cut=True,
            topics=(
                TopicSummary("/c/image", "sensor_msgs/msg/Image", "cdr", 7, 1 / 3, "image"),
                TopicSummary("12", "", "json", 0),
            ),
            links=(LinkSummary("base", "arm", Motion.MOVING, 90),),
            pauses=(PauseSummary(0.1, 1 / 3, 4),),
            ready=False,
            used=UsedParts(
                "/c/image",
                "/c/info",
                camera(rng),
                "camera.yaml",
                "/pose",
                ("base", "tool"),
                "log_time",
            ),
            missing=(MissingFlag("--target"), MissingFlag("--setup", ("a", "b"))),
            command="handeye solve 'a b.mcap' --target SPEC",
        ),
        provenance=PROVENANCE,
    )


def records(rng: np.random.Generator, folder: Path) -> dict[str, Any]:
    return {
        "recording": recording(rng, folder),
        "features": features(rng),
        "stations": stations(rng),
        "calibration": calibration(rng),
        "calibration-eye-to-hand": calibration(rng, Setup.EYE_TO_HAND),
        "verification": verification(rng),
        "inspection": inspection(rng),
        "plan": plan(rng),
    }


def fields_at_default(value: Any, met: dict[str, bool] | None = None) -> list[str]:
    """Fields that no record below `value` gives another value than its default."""
    met = {} if met is None else met
    if is_dataclass(value):
        for field in fields(value):
            name = f"{type(value).__name__}.{field.name}"
            item = getattr(value, field.name)
            met[name] = met.get(name, False) or item is not field.default
            fields_at_default(item, met)
    elif isinstance(value, tuple | dict):
        for item in value.values() if isinstance(value, dict) else value:
            fields_at_default(item, met)
    return [name for name, used in met.items() if not used]


def assert_same(found: Any, expected: Any, path: str = "record") -> None:
    """Equal to the last bit, but for poses, whose rotations pass through a quaternion."""
    assert type(found) is type(expected), path
    if is_dataclass(expected):
        for field in fields(expected):
            name = field.name
            assert_same(getattr(found, name), getattr(expected, name), f"{path}.{name}")
    elif isinstance(expected, tuple):
        assert len(found) == len(expected), path
        for index, (one, other) in enumerate(zip(found, expected, strict=True)):
            assert_same(one, other, f"{path}[{index}]")
    elif isinstance(expected, np.ndarray):
        assert found.dtype == expected.dtype, path
        tolerance = 1e-15 if expected.shape == (4, 4) else 0.0
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=tolerance, err_msg=path)
    else:
        assert found == expected, path
