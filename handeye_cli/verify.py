"""Stage: the paper's 2N-station protocol, section IV-B, and the check of a given calibration."""

from __future__ import annotations

from collections.abc import Sequence

from handeye_cli import solvers
from handeye_cli.chain import MIN_STATIONS, Chain
from handeye_cli.errors import UndeterminedError, UsageError
from handeye_cli.examination import require_conventions
from handeye_cli.existing import check_moved, check_unmoved
from handeye_cli.held_out import held_out_errors, predict_errors
from handeye_cli.held_out_pixels import pixel_errors
from handeye_cli.part_calibration import calibrate_part, noise_of_others, usable_chain
from handeye_cli.records import Calibration, Protocol, Stations, Verification, VerificationRow
from handeye_cli.seen_through import chain_through, stations_through
from handeye_cli.verification_row import row_of

_WAY_OUT = (
    "'--leave-one-out' predicts every station from all others; '--stations' takes other numbers"
)
"""The next step where the first stations of a recording determine nothing."""


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
    chain = usable_chain(stations)
    usable = len(chain.A)
    if usable < 2 * MIN_STATIONS:
        raise UndeterminedError(
            f"expected at least {2 * MIN_STATIONS} usable stations, half to calibrate on and half "
            f"to verify with, found {usable}",
            hint=f"--leave-one-out needs {MIN_STATIONS + 1}; or record more stations",
        )
    require_conventions(stations, chain)
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
    where = f"calibrating on the first {count} of {len(chain.A)} stations"
    try:
        found = calibrate_part(first, stations, method=method, pairs=pairs, where=where)
    except UndeterminedError as error:
        raise UndeterminedError(error.message, where=where, hint=_WAY_OUT) from error
    second = chain_through(stations, second, found.camera)
    errors = held_out_errors(second, found.solution)
    own = noise_of_others(second, stations.noise, found.model.noise, found.solution)
    expected = predict_errors(errors, found.covariance, own, found.freedom())
    seen = pixel_errors(stations, second.index, errors.camera_T_target, found.camera)
    return row_of(stations, second, errors, seen, count=count, prediction=expected)


def verify_calibration(
    stations: Stations, calibration: Calibration, *, target_moved: bool = False
) -> Verification:
    """Check an existing calibration on stations that it has not seen.

    Args:
        stations: The new stations.
        calibration: The answer, with its own covariances and its noise, which predict the errors.
        target_moved: Whether the target has another place than during the calibration; at each
            station it then is where the other new stations see it.

    Raises:
        UsageError: The setups differ.
        UndeterminedError: Fewer than three stations have a target pose.
    """
    if stations.setup is not calibration.setup:
        raise UsageError(
            f"expected a recording of the calibration's setup, {calibration.setup.value}, found "
            f"{stations.setup.value}",
            hint="check --setup",
        )
    check = check_moved if target_moved else check_unmoved
    stations = stations_through(stations, calibration.camera)
    row, findings = check(stations, usable_chain(stations), calibration)
    return Verification(
        setup=stations.setup,
        method=calibration.method,
        rows=(row,),
        diagnosis=(*stations.findings, *findings),
        provenance=stations.provenance,
        protocol=Protocol.MOVED_TARGET if target_moved else Protocol.CALIBRATION,
    )
