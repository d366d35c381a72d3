"""Stage: the paper's 2N-station protocol, section IV-B, and the check of a given calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from handeye_cli import solvers
from handeye_cli.chain import MIN_STATIONS, Chain, chain_of
from handeye_cli.errors import UndeterminedError, UsageError
from handeye_cli.held_out import HeldOutErrors, held_out_errors, predict_errors
from handeye_cli.motion_check import check_motions
from handeye_cli.noise_levels import noise_model
from handeye_cli.predict import scale_freedom, solution_covariance
from handeye_cli.records import (
    Calibration,
    Noise,
    StationError,
    Stations,
    Verification,
    VerificationRow,
)
from handeye_cli.solve import choose_pairs, estimate
from handeye_cli.solvers.problem import Solution
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
    try:
        check_motions(first, chosen, stations.setup)
    except UndeterminedError as error:
        where = f"calibrating on the first {count} of {len(chain.A)} stations"
        raise UndeterminedError(error.message, where=where, hint=error.hint) from error
    problem, solution, model = estimate(first, chosen, stations, method)
    X = solution.X
    answer = solvers.load(method).influence(problem, solution)[:, :6]
    both = np.concatenate([answer, mean_influence(first.A, first.B, X, answer)], axis=1)
    averaged = Solution(X, mean_target(first.A, first.B, X))
    errors = held_out_errors(second, averaged)
    levels = replace(
        stations.noise or Noise(),
        robot_rotation=model.noise.robot_rotation,
        robot_translation=model.noise.robot_translation,
    )
    own = noise_model(second, _complete(levels, second), averaged).covariance
    freedom = scale_freedom(both, model)
    expected = predict_errors(errors, solution_covariance(both, model.covariance), own, freedom)
    return replace(
        _seen(stations, second, count, errors),
        predicted_rotation=expected.rotation,
        predicted_translation=expected.translation,
        consistent=expected.consistent,
    )


def _complete(levels: Noise, chain: Chain) -> Noise:
    """Return levels that leave nothing to estimate at the verification stations."""
    if chain.has_covariance:
        return levels
    return replace(
        levels,
        camera_rotation=levels.camera_rotation or 0.0,
        camera_translation=levels.camera_translation or 0.0,
    )


def _seen(stations: Stations, chain: Chain, count: int, errors: HeldOutErrors) -> VerificationRow:
    rotation, translation = errors.rotation, errors.translation
    rows = tuple(
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
        errors=rows,
    )


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
    answer = Solution(calibration.mount_T_camera.matrix, calibration.reference_T_target.matrix)
    used = sum(station.used for station in calibration.stations)
    return Verification(
        setup=stations.setup,
        method=calibration.method,
        rows=(_seen(stations, chain, used, held_out_errors(chain, answer)),),
        diagnosis=stations.findings,
        provenance=stations.provenance,
    )
