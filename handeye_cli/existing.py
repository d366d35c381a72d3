"""How an existing calibration does at new stations, the target left in place or moved.

The covariances of the calibration predict the errors. Those of camera and target belong together:
near the stations of the calibration their errors cancel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.conventions import MM, MRAD
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.held_out import (
    HeldOutErrors,
    HeldOutPrediction,
    chance_of,
    error_covariances,
    held_out_errors,
    own_covariances,
    predict_errors,
    rms_of,
    root_of,
    weighted_squares,
)
from handeye_cli.held_out_pixels import pixel_errors
from handeye_cli.part_calibration import noise_of_others
from handeye_cli.records import Calibration, Finding, FloatArray, Stations, VerificationRow
from handeye_cli.solvers.problem import Solution
from handeye_cli.solvers.station_mean import mean_target
from handeye_cli.verification_row import row_of

_TARGET = slice(6, 12)
"""Where the target's pose stands among the unknowns."""
_FEWER = 2.0
"""Factor by which a place of its own for the target must shrink the errors to look moved."""

Checked = tuple[VerificationRow, tuple[Finding, ...]]


@dataclass(frozen=True)
class _Known:
    """What a calibration says of its own error.

    Attributes:
        covariance: (12 + q, 12 + q) of X, Z and the q errors that the new stations share.
        freedom: Degrees of freedom with which its noise was estimated.
        joint: Whether it says how X and Z belong together.
    """

    covariance: FloatArray
    freedom: float
    joint: bool


def check_unmoved(stations: Stations, chain: Chain, calibration: Calibration) -> Checked:
    """Return the errors, and what there is to say of them, the target left in place.

    Args:
        stations: The new stations.
        chain: Their chain.
        calibration: The answer.
    """
    solution = Solution(calibration.mount_T_camera.matrix, calibration.reference_T_target.matrix)
    errors = held_out_errors(chain, solution)
    known, prediction, findings = _known(calibration, chain), None, []
    if known is not None:
        own = noise_of_others(chain, stations.noise, calibration.noise, solution)
        prediction = predict_errors(errors, known.covariance, own, known.freedom)
        findings += [] if known.joint else [_NOT_JOINT]
    row = _row(stations, chain, errors, calibration, prediction)
    if row.consistent is not True:
        findings += _moved(row, chain, solution)
    return row, tuple(findings)


_NOT_JOINT = Finding(
    "covariance-incomplete",
    "warning",
    "the calibration does not say how the errors of camera and target belong together: they are "
    "taken as independent, which mostly predicts too large an error and finds too much consistent",
    "calibrate again with this version, which writes covariance_between",
)


def check_moved(stations: Stations, chain: Chain, calibration: Calibration) -> Checked:
    """Return the errors against the target's place as the other new stations see it.

    Args:
        stations: The new stations.
        chain: Their chain.
        calibration: The answer.
    """
    X, before = calibration.mount_T_camera.matrix, calibration.reference_T_target.matrix
    errors = held_out_errors(chain, Solution(X, _by_others(chain, X)))
    now = mean_target(chain.A, chain.B, X)
    known, prediction = _known(calibration, chain), None
    if known is not None:
        own = noise_of_others(chain, stations.noise, calibration.noise, Solution(X, now))
        prediction = _predict_moved(errors, chain, Solution(X, now), known, own)
    row = _row(stations, chain, errors, calibration, prediction)
    placed = Finding(
        "target-placed-anew",
        "info",
        f"the target's place was taken from the new stations: {_apart(now, before)} from where the "
        "calibration has it",
    )
    return row, (placed,)


def _known(calibration: Calibration, chain: Chain) -> _Known | None:
    """Return what predicts errors at new stations, whose shared errors count as independent."""
    answer = calibration.mount_T_camera.covariance
    constant = calibration.reference_T_target.covariance
    if answer is None or constant is None:
        return None
    between = calibration.covariance_between
    joint = between is not None
    across = np.zeros((6, 6)) if between is None else between
    size = chain.by_causes.shape[-1]
    covariance = np.eye(12 + size)
    covariance[:12, :12] = np.block([[answer, across], [across.T, constant]])
    return _Known(covariance, _freedom(calibration), joint)


def _freedom(calibration: Calibration) -> float:
    if not calibration.noise_estimated:
        return math.inf
    if calibration.noise_freedom is not None:
        return calibration.noise_freedom
    # Three equations a station, for its rotation as for its translation, less six unknowns each.
    used = sum(station.used for station in calibration.stations)
    return max(3.0 * used - 6.0, 1.0)


def _row(
    stations: Stations,
    chain: Chain,
    errors: HeldOutErrors,
    calibration: Calibration,
    prediction: HeldOutPrediction | None,
) -> VerificationRow:
    used = sum(station.used for station in calibration.stations)
    seen = pixel_errors(stations, chain.index, errors.camera_T_target, stations.camera)
    return row_of(stations, chain, errors, seen, count=used, prediction=prediction)


def _moved(row: VerificationRow, chain: Chain, solution: Solution) -> list[Finding]:
    """Return the finding that a target which was moved would explain the errors, if so."""
    own = held_out_errors(chain, Solution(solution.X, _by_others(chain, solution.X)))
    rotation, translation = (
        float(np.sqrt(np.mean(each**2))) for each in (own.rotation, own.translation)
    )
    if row.rotation < _FEWER * rotation and row.translation < _FEWER * translation:
        return []
    now = mean_target(chain.A, chain.B, solution.X)
    message = (
        f"the new stations see the target {_apart(now, solution.Z)} from where the calibration has "
        f"it; against that place of its own the errors are {rotation / MRAD:.3f} mrad and "
        f"{translation / MM:.3f} mm"
    )
    advice = "if the target was moved since the calibration, say --target-moved"
    return [Finding("target-moved", "warning", message, advice)]


def _apart(pose: FloatArray, other: FloatArray) -> str:
    distance = float(np.linalg.norm(pose[:3, 3] - other[:3, 3]))
    turn = float(rotations.angle(pose[:3, :3].T @ other[:3, :3]))
    return f"{distance / MM:.3f} mm and {turn / MRAD:.3f} mrad"


def _by_others(chain: Chain, X: FloatArray) -> FloatArray:
    """Return (M, 4, 4): the target's mean pose over all stations but each one."""
    seen = chain.A @ X @ chain.B
    R, t = _mean_of_others(seen[:, :3, :3]), _mean_of_others(seen[:, :3, 3])
    return se3.from_parts(rotations.project_to_so3(R), t)


def _predict_moved(
    errors: HeldOutErrors, chain: Chain, solution: Solution, known: _Known, own: FloatArray
) -> HeldOutPrediction:
    """Predict the errors against a target's pose that M - 1 stations see on average.

    The verdict fits the target's pose, six unknowns, with the weights of the covariances; where
    the errors are measured from does not matter to it.
    """
    rotation, translation = rms_of(
        error_covariances(errors, _placed_by_others(chain, solution, known, own), own)
    )
    common = held_out_errors(chain, solution)
    others = np.delete(np.arange(len(known.covariance)), _TARGET)
    shared = common.by_common[..., others] @ root_of(known.covariance[np.ix_(others, others)])
    fitted = common.by_common[..., _TARGET]
    squares = weighted_squares(common.vectors, own_covariances(common, own), shared, fitted)
    chance = chance_of(squares, common.vectors.size - 6, known.freedom)
    return HeldOutPrediction(rotation, translation, float(chance))


def _placed_by_others(
    chain: Chain, solution: Solution, known: _Known, own: FloatArray
) -> FloatArray:
    """Return (M, 12 + q, 12 + q): `known`, the target's part by the other stations' mean."""
    loop = loop_jacobians(chain.A, chain.B, solution.X, solution.Z)
    seen = loop.by_poses @ own @ np.swapaxes(loop.by_poses, -1, -2)
    count, size = len(own), len(known.covariance)
    moves = np.tile(np.eye(size), (count, 1, 1))
    moves[:, _TARGET] = 0.0
    moves[:, _TARGET, :6] = _mean_of_others(loop.by_unknowns[..., :6])
    moves[:, _TARGET, 12:] = _mean_of_others(chain.by_shared_causes(loop))
    joint = moves @ known.covariance @ np.swapaxes(moves, -1, -2)
    joint[:, _TARGET, _TARGET] += _mean_of_others(seen) / (count - 1)
    return np.asarray(joint)


def _mean_of_others(values: FloatArray) -> FloatArray:
    return np.asarray((values.sum(axis=0) - values) / (len(values) - 1))
