"""Stage: the calibration as far as the stations determine it, for robots that turn too little."""

from __future__ import annotations

from handeye_cli import solvers
from handeye_cli.chain import MIN_STATIONS, chain_of
from handeye_cli.diagnosis.partial import solve_partial
from handeye_cli.diagnosis.undetermined import free_directions
from handeye_cli.examination import Examined, examine, require_sound
from handeye_cli.records import Calibration, Finding, FreeDirection, PartialAnswer, Stations
from handeye_cli.residual_table import residual_table
from handeye_cli.solve import answer


def solve_determined(
    stations: Stations, *, method: str = solvers.DEFAULT, pairs: str = "star"
) -> Calibration:
    """Compute what the stations determine of the camera's place, and name what they leave free.

    Where nothing is free this is `solve`.

    Args:
        stations: Robot and target poses; one station will do where the noise is given.
        method: A row of the table of solvers, for an answer that is wholly determined.
        pairs: `star` or `all`, likewise.

    Raises:
        UndeterminedError: No station, or stations that contradict each other or what was declared.
        ConvergenceError: The estimation did not settle.
    """
    everybody = chain_of(stations, fewest=1)
    examined = examine(stations, everybody)
    require_sound(examined)
    chain = examined.chain
    if len(chain.A) >= MIN_STATIONS and not any(free_directions(chain, stations.noise).counts):
        return answer(stations, method=method, pairs=pairs, examined=examined).calibration
    return _calibration(stations, examined, solve_partial(stations, chain))


def _calibration(stations: Stations, examined: Examined, part: PartialAnswer) -> Calibration:
    return Calibration(
        setup=part.setup,
        method=solvers.MAXIMUM_LIKELIHOOD,
        mount_T_camera=part.mount_T_camera,
        reference_T_target=part.reference_T_target,
        predicted_error=part.predicted_error,
        noise=part.noise,
        noise_estimated=part.noise_estimated,
        stations=residual_table(stations, examined, part.residuals),
        diagnosis=(*stations.findings, *examined.findings, _told(part.free, part.setup.answer)),
        camera=stations.camera,
        provenance=stations.provenance,
        covariance_between=part.covariance[:6, 6:],
        noise_freedom=part.noise_freedom,
        free=part.free,
    )


def _told(free: tuple[FreeDirection, ...], answer: str) -> Finding:
    return Finding(
        "partly-determined",
        "warning",
        f"not determined of {answer}: {'; '.join(each.words for each in free)}. There its value is "
        "the choice nearest to the identity, and its covariance is zero",
        "measure what is free in another way, or add stations turned about another axis",
    )
