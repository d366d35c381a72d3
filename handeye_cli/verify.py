"""Stage: the paper's 2N-station protocol, section IV-B, and the check of a given calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from handeye_cli import solvers
from handeye_cli.chain import MIN_STATIONS, Chain, chain_of
from handeye_cli.errors import UndeterminedError, UsageError
from handeye_cli.geometry import rotations, se3
from handeye_cli.motion_check import check_motions
from handeye_cli.predict import solution_covariance
from handeye_cli.records import (
    Calibration,
    FloatArray,
    StationError,
    Stations,
    Verification,
    VerificationRow,
)
from handeye_cli.solve import choose_pairs, estimate
from handeye_cli.solvers.station_mean import mean_influence, mean_target


def verify(
    stations: Stations,
    *,
    counts: Sequence[int] | None = None,
    method: str = solvers.DEFAULT,
    pairs: str = "star",
) -> Verification:
    """Calibrate on stations 1..N and predict the camera's pose at stations N+1..2N, for each N.

    Args:
        stations: Robot and target poses, in the order they were recorded.
        counts: The Ns; half of the usable stations when not given.
        method: A row of the table of solvers.
        pairs: `star` or `all`.

    Raises:
        UsageError: An N below three, or more stations asked for than there are.
        UndeterminedError: Too few stations, or motions that determine nothing.
        ConvergenceError: The estimation did not settle.
    """
    chain = chain_of(stations)
    usable = len(chain.A)
    if usable < 2 * MIN_STATIONS:
        raise UndeterminedError(
            f"expected at least {2 * MIN_STATIONS} usable stations, half to calibrate on and half "
            f"to verify with, found {usable}",
            hint="record more stations",
        )
    counts = list(counts) if counts else [usable // 2]
    for count in counts:
        if count < MIN_STATIONS or 2 * count > usable:
            raise UsageError(
                f"expected --stations between {MIN_STATIONS} and {usable // 2}, half of the "
                f"{usable} usable stations, found {count}",
            )
    return Verification(
        setup=stations.setup,
        method=method,
        rows=tuple(_row(stations, chain, count, method, pairs) for count in counts),
        diagnosis=stations.findings,
        provenance=stations.provenance,
    )


def _row(stations: Stations, chain: Chain, count: int, method: str, pairs: str) -> VerificationRow:
    first, second = chain.part(slice(0, count)), chain.part(slice(count, 2 * count))
    chosen = choose_pairs(pairs, count)
    check_motions(first, chosen, stations.setup)
    problem, solution, model = estimate(first, chosen, stations.noise, method)
    Z = mean_target(first.A, first.B, solution.X)
    answer = solvers.load(method).influence(problem, solution)[:, :6]
    both = np.concatenate([answer, mean_influence(first.A, first.B, solution.X, answer)], axis=1)
    covariance = solution_covariance(both, model.covariance)
    row = _held_out(stations, second, count, solution.X, Z)
    own = _station_covariance(second, model.covariance)
    predicted = _predicted(second, solution.X, Z, covariance, own)
    return replace(row, predicted_rotation=predicted[0], predicted_translation=predicted[1])


def _held_out(
    stations: Stations, chain: Chain, count: int, X: FloatArray, Z: FloatArray
) -> VerificationRow:
    """Compare the camera's pose by the robot, A X, with that by the camera, Z B^-1."""
    by_robot, by_camera = chain.A @ X, Z @ se3.inverse(chain.B)
    turn = np.swapaxes(by_camera[:, :3, :3], -1, -2) @ by_robot[:, :3, :3]
    rotation = rotations.angle(turn)
    translation = np.linalg.norm(by_robot[:, :3, 3] - by_camera[:, :3, 3], axis=1)
    errors = tuple(
        StationError(stations.stations[index].name, float(angle), float(distance))
        for index, angle, distance in zip(chain.index, rotation, translation, strict=True)
    )
    return VerificationRow(
        stations=count,
        rotation=float(np.sqrt(np.mean(rotation**2))),
        translation=float(np.sqrt(np.mean(translation**2))),
        predicted_rotation=None,
        predicted_translation=None,
        consistent=None,
        errors=errors,
    )


def _station_covariance(chain: Chain, calibrated: FloatArray) -> FloatArray:
    """Return (M, 12, 12): each station's own camera covariance with the robot's level."""
    levels = np.mean(calibrated, axis=0)
    joint = np.tile(levels, (len(chain.A), 1, 1))
    if chain.has_covariance:
        joint[:, 6:, 6:] = chain.camera_covariance
    return joint


def _predicted(
    chain: Chain, X: FloatArray, Z: FloatArray, covariance: FloatArray, own: FloatArray
) -> tuple[float, float]:
    """Return the RMS rotation and translation error that the covariances predict."""
    to_camera = se3.inverse(chain.B)
    by_robot, by_answer = se3.compose_jacobians(chain.A, X)
    by_target, by_inverse = se3.compose_jacobians(Z, to_camera)
    by_camera = by_inverse @ se3.inverse_jacobian(chain.B)
    by_solution = np.concatenate([by_answer, -by_target], axis=-1)
    by_poses = np.concatenate([np.broadcast_to(by_robot, by_camera.shape), -by_camera], axis=-1)
    total = by_solution @ covariance @ np.swapaxes(by_solution, -1, -2)
    total = total + by_poses @ own @ np.swapaxes(by_poses, -1, -2)
    traces = np.einsum("nii->ni", total).mean(axis=0)
    return float(np.sqrt(traces[3:].sum())), float(np.sqrt(traces[:3].sum()))


def verify_calibration(stations: Stations, calibration: Calibration) -> Verification:
    """Check an existing calibration on stations that it has not seen, the target left in place.

    Raises:
        UsageError: The setups differ.
        UndeterminedError: No station has a target pose.
    """
    if stations.setup is not calibration.setup:
        raise UsageError(
            f"expected a recording of the calibration's setup, {calibration.setup.value}, found "
            f"{stations.setup.value}",
            hint="check --setup",
        )
    chain = chain_of(stations)
    X, Z = calibration.mount_T_camera.matrix, calibration.reference_T_target.matrix
    used = sum(station.used for station in calibration.stations)
    return Verification(
        setup=stations.setup,
        method=calibration.method,
        rows=(_held_out(stations, chain, used, X, Z),),
        diagnosis=stations.findings,
        provenance=stations.provenance,
    )
