"""What a recording tells by itself, in the form in which stations can be added to it.

It is what its solution predicts. The covariance of the answer and of uncertain intrinsics becomes
information, to which new stations add theirs. Two parts of the predicted error are none of it: an
error that the recorded poses share pulls at the answer, the less the more stations there are; what
is no noise at all, such as a bent plate or a robot of wrong geometry, would be the same at new
stations, so that it is taken to stay.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handeye_cli import solvers
from handeye_cli.chain import Chain, has_pixels
from handeye_cli.estimates import Estimate
from handeye_cli.estimation import best_estimate, choose_pairs
from handeye_cli.geometry import statistics
from handeye_cli.geometry.loop import isotropic_covariance
from handeye_cli.geometry.scaled_inverse import scaled_inverse
from handeye_cli.planning.levels import CAMERA_LEVELS, camera_covariance
from handeye_cli.planning.prediction import UncertainRig
from handeye_cli.planning.uncertain_sight import UncertainSight
from handeye_cli.predict import solution_covariance
from handeye_cli.records import Calibration, Finding, FloatArray, Noise, Stations
from handeye_cli.sight import Sight, sight_of
from handeye_cli.solve import Answer, answer

_FLOOR = 1e-9
"""Smallest level considered, radians and metres, and pixels."""
_PARTS = (slice(0, 3), slice(3, 6))


@dataclass(frozen=True)
class Recorded:
    """A recording that was solved, with m errors of uncertain intrinsics.

    Attributes:
        chain: Its stations.
        rig: The answer and the noise, as for stations to come.
        information: (1, 12 + m, 12 + m) on X, Z and the errors of the intrinsics.
        pull: (12 + m, q) of the errors that the robot poses share; see `prediction.covariance`.
        lasting: (6, 6) mean squares of X that new stations are not taken to change.
        centre: (3,) point of the target they look at.
        seen: What they see of it, or None where that is unknown.
        noise: The levels this rests on.
        findings: What there is to say of the data.
    """

    chain: Chain
    rig: UncertainRig
    information: FloatArray
    pull: FloatArray
    lasting: FloatArray
    centre: FloatArray
    seen: Sight | None
    noise: Noise
    findings: tuple[Finding, ...]


def solved(stations: Stations, given: Noise, *, method: str) -> Recorded:
    """Solve a recording, and keep what stations to come are added to.

    Args:
        stations: What was recorded.
        given: Noise levels that win over those of the recording.
        method: A row of the table of solvers, for the answer; what stations tell is what maximum
            likelihood takes from them.

    Raises:
        UndeterminedError: The recording does not determine the answer.
        ConvergenceError: The estimation did not settle.
    """
    found = answer(stations, method=method)
    told = replace(stations, noise=_levels(stations.noise or Noise(), given))
    chain = _with_intrinsics(told, found.examined.chain)
    bent = _bent(found)
    estimate = replace(found.estimate, shared=found.estimate.shared - bent)
    lasting = _blocks(found.calibration) - _of_parts(estimate.covariance)
    if given != Noise() or method != solvers.DEFAULT:
        pairs = choose_pairs("star", len(chain.A))
        estimate = best_estimate(chain, pairs, told, solvers.DEFAULT)
    information, pull = _told_by(estimate, chain)
    sight, noise = sight_of(stations, chain), _levels(found.calibration.noise, given)
    return Recorded(
        chain,
        _rig(told, chain, found.calibration, sight, noise),
        information[None],
        pull,
        lasting,
        np.zeros(3) if sight is None else sight.centre,
        sight,
        noise,
        found.calibration.diagnosis,
    )


def _levels(found: Noise, given: Noise) -> Noise:
    """Return levels of which those that are given win."""
    levels = {name: value for name, value in vars(given).items() if value is not None}
    return replace(found, **levels)


def _with_intrinsics(stations: Stations, chain: Chain) -> Chain:
    if not has_pixels(stations, chain):
        return chain
    from handeye_cli.pixel_data import with_intrinsics

    return with_intrinsics(stations, chain)


def _bent(found: Answer) -> FloatArray:
    """Return the (12, 12) mean squares of X and Z that the shape of the plate makes."""
    shape = found.examined.shape
    if shape is None:
        return np.zeros((12, 12))
    return shape.answer_covariance(found.examined.chain, found.estimate.influence)


def _blocks(calibration: Calibration) -> FloatArray:
    covariance = calibration.mount_T_camera.covariance
    if covariance is None:
        raise ValueError("a solution has a covariance")
    return _of_parts(covariance)


def _of_parts(covariance: FloatArray) -> FloatArray:
    """Return (6, 6) with the translation's and the rotation's own covariance of X alone."""
    alone = np.zeros((6, 6))
    for part in _PARTS:
        alone[part, part] = covariance[part, part]
    return alone


def _told_by(estimate: Estimate, chain: Chain) -> tuple[FloatArray, FloatArray]:
    """Return (12 + m, 12 + m) information on X, Z and the intrinsics, and the (12 + m, q) pull."""
    size = chain.by_intrinsics.shape[-1]
    moved = np.concatenate([estimate.with_causes[:, size:], estimate.causes[:size, size:]])
    across = estimate.with_causes[:, :size]
    shared = np.block([[estimate.shared, across], [across.T, estimate.causes[:size, :size]]])
    influence = np.concatenate([estimate.influence, estimate.causes_influence[:, :size]], axis=1)
    random = solution_covariance(influence, estimate.model.covariance)
    information = scaled_inverse(random + shared - moved @ moved.T)
    return information, np.asarray(information @ moved)


def _rig(
    told: Stations, chain: Chain, calibration: Calibration, sight: Sight | None, noise: Noise
) -> UncertainRig:
    robot = isotropic_covariance(
        max(noise.robot_rotation or 0.0, _FLOOR), max(noise.robot_translation or 0.0, _FLOOR)
    )
    return UncertainRig(
        told.setup,
        calibration.mount_T_camera.matrix[None],
        calibration.reference_T_target.matrix[None],
        robot,
        _of_new_ones(told, chain, sight, noise),
    )


def _of_new_ones(
    told: Stations, chain: Chain, sight: Sight | None, noise: Noise
) -> FloatArray | Sight | UncertainSight:
    """Return how the noise of new target poses follows; levels that are stated win."""
    if chain.by_intrinsics.shape[-1]:
        return _through_uncertain_intrinsics(told, noise)
    stated = told.noise or Noise()
    if sight is None or any(getattr(stated, name) is not None for name in CAMERA_LEVELS):
        return camera_covariance(replace(noise, pixel=None), None, None)
    sigma = noise.pixel if noise.pixel is not None else statistics.median(sight.sigma)
    everything = np.ones((1, len(sight.points)), dtype=bool)
    return Sight(sight.points, everything, sight.camera, np.array([max(sigma, _FLOOR)]))


def _through_uncertain_intrinsics(told: Stations, noise: Noise) -> UncertainSight:
    from handeye_cli.pixel_data import pixel_data

    data = pixel_data(told)
    sigma = noise.pixel if noise.pixel is not None else statistics.median(data.sigma)
    points = data.views.seen.points
    return UncertainSight(points, data.camera, data.directions, max(sigma, _FLOOR))
