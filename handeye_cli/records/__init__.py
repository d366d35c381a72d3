"""What flows along the line: recording -> features -> stations -> calibration -> verification.

Frozen, with arrays in float64, metres and radians. A pose is a 4x4 homogeneous matrix. Covariances
are 6x6 in the order (x, y, z, rx, ry, rz), of a perturbation in the parent frame: `t + dt`,
`Exp(dr) R`.
"""

from __future__ import annotations

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
)
from handeye_cli.records.results import (
    Calibration,
    Comparison,
    CriticalFactors,
    Improvement,
    PaperPrediction,
    Plan,
    PlannedStation,
    PredictedError,
    Protocol,
    Spread,
    StationError,
    StationResidual,
    Verification,
    VerificationRow,
)

__all__ = [
    "Calibration",
    "Camera",
    "Comparison",
    "CriticalFactors",
    "Features",
    "Finding",
    "FloatArray",
    "GreyImage",
    "ImageSource",
    "Improvement",
    "IntArray",
    "Noise",
    "Observation",
    "PaperPrediction",
    "Plan",
    "PlannedStation",
    "PredictedError",
    "Protocol",
    "ProvenanceStep",
    "RecordedStation",
    "Recording",
    "Spread",
    "Station",
    "StationError",
    "StationResidual",
    "Stations",
    "TargetSpec",
    "UncertainPose",
    "Verification",
    "VerificationRow",
]
