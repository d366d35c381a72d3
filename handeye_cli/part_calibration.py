"""A calibration on some of a recording's stations, as it is needed to predict the others."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handeye_cli.chain import Chain, chain_of
from handeye_cli.errors import UndeterminedError
from handeye_cli.estimates import Estimate
from handeye_cli.estimation import best_estimate, choose_pairs
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.motion_check import check_motions
from handeye_cli.noise_levels import NoiseModel, noise_model
from handeye_cli.predict import noise_freedom, solution_covariance
from handeye_cli.records import Camera, FloatArray, Noise, Stations
from handeye_cli.seen_through import chain_through
from handeye_cli.solvers.problem import Solution
from handeye_cli.solvers.station_mean import mean_influence, mean_target


@dataclass(frozen=True)
class PartCalibration:
    """The answer of n stations, with the target where they see it on average (paper, step 2).

    Attributes:
        part: The stations.
        solution: X, and Z as the mean over the stations.
        influence: (n, 12, 12) how both move with each station's poses.
        shared: (12 + m, 12 + m) covariance that the m errors of the intrinsics cause, of X, Z and
            these errors themselves (`Chain.by_intrinsics`).
        model: The noise of these stations.
        camera: The intrinsics that belong to the answer, refined where they were uncertain.
    """

    part: Chain
    solution: Solution
    influence: FloatArray
    shared: FloatArray
    model: NoiseModel
    camera: Camera | None

    @property
    def covariance(self) -> FloatArray:
        """(12 + m, 12 + m) covariance of X, Z and the errors of the intrinsics."""
        total = self.shared.copy()
        total[:12, :12] += solution_covariance(self.influence, self.model.covariance)
        return total

    def freedom(self, part: slice = slice(0, 6)) -> float:
        """Return the degrees of freedom of the estimated noise; infinite where it was given.

        Args:
            part: Of the six residuals of a loop, those that count.
        """
        return noise_freedom(self.part, self.solution, self.model, part)


def usable_chain(stations: Stations) -> Chain:
    """Return the chain of a document, with what its target poses owe to the intrinsics.

    Raises:
        UndeterminedError: Fewer than three stations have a target pose.
        InputError: Pixels are not those of the station's pose.
    """
    chain = chain_of(stations)
    if stations.camera is None or stations.target is None:
        return chain
    from handeye_cli.pixel_data import with_intrinsics

    return with_intrinsics(stations, chain)


def calibrate_part(
    part: Chain, stations: Stations, *, method: str, pairs: str, where: str
) -> PartCalibration:
    """Calibrate on some stations of a document.

    Args:
        part: Their chain.
        stations: The document, for its setup, its given noise and its pixels.
        method: A row of the table of solvers.
        pairs: `star` or `all`.
        where: What is said about the part if it determines nothing.

    Raises:
        UsageError: Unknown method or pairs.
        UndeterminedError: The part's motions determine nothing.
        ConvergenceError: The estimation did not settle.
    """
    chosen = choose_pairs(pairs, len(part.A))
    try:
        check_motions(part, chosen, stations.setup)
    except UndeterminedError as error:
        raise UndeterminedError(error.message, where=where, hint=error.hint) from error
    found = best_estimate(part, chosen, stations, method)
    X, answer = found.solution.X, found.influence[:, :6]
    both = np.concatenate([answer, mean_influence(part.A, part.B, X, answer)], axis=1)
    part = chain_through(stations, part, found.camera)
    averaged = Solution(X, mean_target(part.A, part.B, X))
    by_times = part.shared_covariance(found.influence)[:6, :6]
    intrinsics = _intrinsics(stations.camera, found.camera)
    shared = _shared(part, averaged, found, by_times, intrinsics)
    shared[:12, :12] += part.shared_covariance(both)
    return PartCalibration(part, averaged, both, shared, found.model, found.camera)


def _intrinsics(before: Camera | None, after: Camera | None) -> FloatArray:
    """Return the (m, m) covariance of the intrinsics' errors, of unit variance before."""
    if before is None or before.covariance is None or after is None or after.covariance is None:
        return np.zeros((0, 0))
    from handeye_cli.geometry.joint_bundle import uncertain_directions

    back = np.linalg.pinv(uncertain_directions(before.covariance))
    return np.asarray(back @ after.covariance @ back.T)


def _shared(
    part: Chain, averaged: Solution, found: Estimate, by_times: FloatArray, intrinsics: FloatArray
) -> FloatArray:
    """Return the covariance by intrinsics of X, of the mean Z, which follows both, and of them.

    `by_times` is the part of X's that an error of all robot poses causes, and no intrinsics.
    """
    loop = loop_jacobians(part.A, part.B, averaged.X, averaged.Z)
    by_answer = loop.by_unknowns[..., :6].mean(axis=0)
    by_intrinsics = (loop.by_camera @ part.by_intrinsics).mean(axis=0)
    size = by_intrinsics.shape[1]
    across = found.with_intrinsics[:6]
    causes = np.block(
        [[found.shared[:6, :6] - by_times, across], [across.T, intrinsics[:size, :size]]]
    )
    moves = np.eye(12 + size, 6 + size, k=-6)
    moves[:6, :6], moves[6:12] = np.eye(6), np.concatenate([by_answer, by_intrinsics], axis=1)
    return np.asarray(moves @ causes @ moves.T)


def noise_of_others(
    others: Chain, given: Noise | None, known: Noise, solution: Solution
) -> FloatArray:
    """Return the (M, 12, 12) covariances of stations that took no part in a calibration.

    Args:
        others: Their chain.
        given: Levels that their document gives.
        known: Levels of the calibration, for the robot and, where the poses of the target come
            without covariances, for the camera. There all may be put down to the robot.
        solution: A solution to linearise at.
    """
    given = given or Noise()
    levels = replace(
        given,
        robot_rotation=_first(given.robot_rotation, known.robot_rotation),
        robot_translation=_first(given.robot_translation, known.robot_translation),
    )
    if not others.has_covariance:
        levels = replace(
            levels,
            camera_rotation=_first(given.camera_rotation, known.camera_rotation),
            camera_translation=_first(given.camera_translation, known.camera_translation),
        )
    covariance = noise_model(others, levels, solution).covariance
    # with that of the answer it would partly cancel: counted by itself, it is never too small
    shared = others.by_shared_error
    covariance[:, :6, :6] += shared @ np.swapaxes(shared, -1, -2)
    return covariance


def _first(level: float | None, otherwise: float | None) -> float:
    return level if level is not None else otherwise or 0.0
