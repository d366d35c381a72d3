"""What flows along the line: recording -> features -> stations -> calibration -> verification.

Frozen, with arrays in float64, metres and radians. A pose is a 4x4 homogeneous matrix. Covariances
are 6x6 in the order (x, y, z, rx, ry, rz), of a perturbation in the parent frame: `t + dt`,
`Exp(dr) R`.

What only some commands need is loaded when it is asked for: a record costs half a millisecond.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from handeye_cli.lazily import loader
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
from handeye_cli.records.line import (
    Features,
    ImageSource,
    Observation,
    RecordedStation,
    Recording,
    Station,
    Stations,
    WrittenRotation,
)
from handeye_cli.records.results import (
    Calibration,
    Comparison,
    CriticalFactors,
    Improvement,
    PaperPrediction,
    PredictedError,
    Spread,
    StationResidual,
)

if TYPE_CHECKING:
    from handeye_cli.records.bad_stations import (
        BadKind,
        BadStation,
        BadStations,
        TargetMove,
        WithoutBadStations,
    )
    from handeye_cli.records.blame import BlameShares, SmoothResiduals
    from handeye_cli.records.free import FreeDirection, PosePart
    from handeye_cli.records.hypotheses import ConventionVerdict, HypothesisFit, LengthRatio
    from handeye_cli.records.inspection import Inspection
    from handeye_cli.records.partial import PartialAnswer
    from handeye_cli.records.plan import Plan, PlannedStation
    from handeye_cli.records.simulation import Simulation
    from handeye_cli.records.verification import (
        Protocol,
        StationError,
        Verification,
        VerificationRow,
    )

__all__ = [
    "BadKind",
    "BadStation",
    "BadStations",
    "BlameShares",
    "Calibration",
    "Camera",
    "Comparison",
    "ConventionVerdict",
    "CriticalFactors",
    "Features",
    "Finding",
    "FloatArray",
    "FreeDirection",
    "GreyImage",
    "HypothesisFit",
    "ImageSource",
    "Improvement",
    "Inspection",
    "IntArray",
    "LengthRatio",
    "Noise",
    "Observation",
    "PaperPrediction",
    "PartialAnswer",
    "Plan",
    "PlannedStation",
    "PosePart",
    "PredictedError",
    "Protocol",
    "ProvenanceStep",
    "RecordedStation",
    "Recording",
    "Simulation",
    "SmoothResiduals",
    "Spread",
    "Station",
    "StationError",
    "StationResidual",
    "Stations",
    "TargetMove",
    "TargetSpec",
    "UncertainPose",
    "Verification",
    "VerificationRow",
    "WithoutBadStations",
    "WrittenRotation",
]

_HOMES = {
    "handeye_cli.records.bad_stations": (
        "BadKind",
        "BadStation",
        "BadStations",
        "TargetMove",
        "WithoutBadStations",
    ),
    "handeye_cli.records.blame": (
        "BlameShares",
        "SmoothResiduals",
    ),
    "handeye_cli.records.free": (
        "FreeDirection",
        "PosePart",
    ),
    "handeye_cli.records.hypotheses": (
        "ConventionVerdict",
        "HypothesisFit",
        "LengthRatio",
    ),
    "handeye_cli.records.inspection": ("Inspection",),
    "handeye_cli.records.partial": ("PartialAnswer",),
    "handeye_cli.records.plan": ("Plan", "PlannedStation"),
    "handeye_cli.records.simulation": ("Simulation",),
    "handeye_cli.records.verification": (
        "Protocol",
        "StationError",
        "Verification",
        "VerificationRow",
    ),
}

__getattr__ = loader(__name__, _HOMES)
