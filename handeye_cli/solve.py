"""Stage: from stations to the calibration, with its predicted error."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handeye_cli import solvers
from handeye_cli.advice import advise
from handeye_cli.chain import MIN_STATIONS, Chain, chain_of
from handeye_cli.diagnosis.bad_stations import effect_of
from handeye_cli.diagnosis.systematic import Systematic, systematic_errors
from handeye_cli.errors import ConvergenceError, UndeterminedError
from handeye_cli.estimates import Estimate
from handeye_cli.estimation import best_estimate, choose_pairs, estimate
from handeye_cli.examination import Examined, examine, require_sound
from handeye_cli.geometry import se3
from handeye_cli.motion_check import check_certainty, check_count, check_freedom, check_motions
from handeye_cli.predict import noise_freedom, paper_prediction, predicted_error
from handeye_cli.records import (
    Calibration,
    FloatArray,
    IntArray,
    Noise,
    PredictedError,
    Stations,
    UncertainPose,
)
from handeye_cli.residual_table import residual_table


@dataclass(frozen=True)
class Answer:
    """A calibration with what it was made from.

    Attributes:
        calibration: The calibration.
        examined: What was found out about the stations; the chain in it is that of the good ones.
        estimate: What its error consists of.
    """

    calibration: Calibration
    examined: Examined
    estimate: Estimate


def solve(stations: Stations, *, method: str = solvers.DEFAULT, pairs: str = "star") -> Calibration:
    """Compute where the camera sits, and how sure that is.

    Args:
        stations: Robot and target poses; stations without a target pose, and those that all others
            contradict, are left out.
        method: A row of the table of solvers.
        pairs: `star` for the paper's star drawing or `all`; used by the closed forms.

    Raises:
        UsageError: Unknown method or pairs.
        UndeterminedError: Fewer than three stations, rotations about one axis only, stations that
            contradict each other, or what was declared of them.
        ConvergenceError: The estimation did not settle.
    """
    return answer(stations, method=method, pairs=pairs).calibration


def answer(
    stations: Stations,
    *,
    method: str = solvers.DEFAULT,
    pairs: str = "star",
    examined: Examined | None = None,
) -> Answer:
    """Compute the calibration and keep what it was made from; see `solve`.

    `examined` is what is known of the stations already; they are examined where it is not given.
    """
    setup = stations.setup
    everybody = _usable(stations) if examined is None else examined.everybody
    check_count(everybody, setup, len(stations.stations))
    examined = examine(stations, everybody) if examined is None else examined
    require_sound(examined)
    chain = examined.chain
    chosen = choose_pairs(pairs, len(chain.A))
    spread = check_motions(chain, chosen, setup)
    found = _estimate(chain, chosen, stations, method)
    bent = _bent(examined, found)
    found = replace(found, shared=found.shared + bent)
    paper = paper_prediction(chain, chosen, found.model.covariance)
    error = predicted_error(found.influence, found.model, paper, found.shared)
    check_certainty(error, found.model.covariance, spread, setup, chain=chain, given=stations.noise)
    calibration = _calibration(stations, examined, chosen, found, method=method, error=error)
    calibration = _with_effect(calibration, stations, examined, pairs)
    judged = _judged(Answer(calibration, examined, found), stations)
    widened = _squares(judged.calibration.predicted_error) - _squares(error)
    lasting = widened + _lasting(chain, found, bent)
    return replace(judged, calibration=_advised(judged, stations, chosen, lasting))


def _usable(stations: Stations) -> Chain:
    """Return the chain of all usable stations; the last of too few are refused with their chain."""
    seen = any(station.camera_T_target is not None for station in stations.stations)
    return chain_of(stations, fewest=1 if seen else MIN_STATIONS)


def _bent(examined: Examined, found: Estimate) -> FloatArray:
    """Return the (12, 12) mean squares of X and Z that the shape of the plate makes."""
    if examined.shape is None:
        return np.zeros((12, 12))
    # what is bent moves the target's poses alike, whatever the answer rests on
    return examined.shape.answer_covariance(examined.chain, found.influence)


def _lasting(chain: Chain, found: Estimate, bent: FloatArray) -> FloatArray:
    """Return the (2,) squares of rotation and translation of X that no advice takes away.

    They are those of the plate's shape and of an error that all robot poses share.
    """
    moved = np.einsum("nij,njk->ik", found.influence[..., :6], chain.by_shared_error)
    return se3.by_kind(np.diag(bent + moved @ moved.T)[:6])[::-1]


def _squares(error: PredictedError) -> FloatArray:
    return np.array([error.rotation, error.translation]) ** 2


def _advised(
    found: Answer, stations: Stations, chosen: IntArray, lasting: FloatArray
) -> Calibration:
    """Return the calibration with what limits it and what would help."""
    calibration, estimated = found.calibration, found.estimate
    factors, improvements = advise(
        stations,
        found.examined.chain,
        chosen,
        method=calibration.method,
        solution=estimated.solution,
        model=estimated.model,
        error=calibration.predicted_error,
        lasting=lasting,
    )
    return replace(calibration, factors=factors, improvements=improvements)


def _estimate(chain: Chain, chosen: IntArray, stations: Stations, method: str) -> Estimate:
    """Return the best estimate, or say what is free where there is none."""
    try:
        return best_estimate(chain, chosen, stations, method)
    except ConvergenceError:
        check_freedom(chain, stations.noise, stations.setup)
        raise


def _judged(found: Answer, stations: Stations) -> Answer:
    """Return the answer with all that is said of its data, its prediction widened by it."""
    examined = found.examined
    shape, chain = examined.shape, examined.chain
    if shape is not None:
        from handeye_cli.pixel_data import with_intrinsics

        chain = shape.beside(with_intrinsics(stations, chain))
    systematic = systematic_errors(found.estimate, chain, stations.noise, stations.setup)
    diagnosis = (
        *stations.findings,
        *examined.findings,
        *found.estimate.findings,
        *(shape.findings if shape else ()),
        *systematic.findings,
    )
    calibration = replace(_widened(found.calibration, systematic), diagnosis=diagnosis)
    return replace(found, calibration=calibration)


def _calibration(
    stations: Stations,
    examined: Examined,
    chosen: IntArray,
    found: Estimate,
    *,
    method: str,
    error: PredictedError,
) -> Calibration:
    solution, model, chain = found.solution, found.model, examined.chain
    covariance = found.covariance
    return Calibration(
        setup=stations.setup,
        method=method,
        mount_T_camera=UncertainPose(solution.X, covariance[:6, :6]),
        reference_T_target=UncertainPose(solution.Z, covariance[6:, 6:]),
        predicted_error=error,
        noise=_with_pixel_noise(model.noise, stations),
        noise_estimated=len(model.shapes) > 0,
        stations=residual_table(stations, examined, found.residuals),
        pairs=tuple((int(chain.index[i]), int(chain.index[j])) for i, j in chosen),
        camera=found.camera,
        provenance=stations.provenance,
        covariance_between=covariance[:6, 6:],
        noise_freedom=noise_freedom(chain, solution, model) if model.shapes.size else None,
    )


def _widened(calibration: Calibration, systematic: Systematic) -> Calibration:
    """Return the calibration with what systematic errors add to its own; the paper knows none."""
    X, Z, between = (
        calibration.mount_T_camera,
        calibration.reference_T_target,
        calibration.covariance_between,
    )
    if systematic.widening == 1.0 or between is None:
        return calibration
    joint = systematic.widened(np.block([[X.covariance, between], [between.T, Z.covariance]]))
    error = calibration.predicted_error
    return replace(
        calibration,
        mount_T_camera=replace(X, covariance=joint[:6, :6]),
        reference_T_target=replace(Z, covariance=joint[6:, 6:]),
        covariance_between=joint[:6, 6:],
        predicted_error=replace(
            error,
            rotation=systematic.rotation * error.rotation,
            translation=systematic.translation * error.translation,
            rotation_95=systematic.rotation * error.rotation_95,
            translation_95=systematic.translation * error.translation_95,
        ),
    )


def _with_effect(
    calibration: Calibration, stations: Stations, examined: Examined, pairs: str
) -> Calibration:
    """Return the calibration with how far the answer on all stations is from it."""
    if not examined.reasons:
        return calibration
    names = tuple(stations.stations[index].name for index in sorted(examined.reasons))
    everybody = examined.everybody
    try:
        _, solution, _ = estimate(
            everybody, choose_pairs(pairs, len(everybody.A)), stations, calibration.method
        )
    except (UndeterminedError, ConvergenceError):
        return calibration
    effect = effect_of(names, solution.X, calibration.mount_T_camera.matrix)
    return replace(calibration, without=effect)


def _with_pixel_noise(noise: Noise, stations: Stations) -> Noise:
    """Return the levels with the RMS of the stations' pixel noise where it was not given."""
    seen = [station.observation for station in stations.stations if station.camera_T_target]
    sigmas = [each.sigma_px for each in seen if each is not None and each.sigma_px is not None]
    if noise.pixel is not None or not sigmas:
        return noise
    return replace(noise, pixel=float(np.sqrt(np.mean(np.square(sigmas)))))
