"""A calibration on some of a recording's stations, as it is needed to predict the others."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handeye_cli.chain import Chain, chain_of
from handeye_cli.errors import UndeterminedError
from handeye_cli.estimation import best_estimate, choose_pairs
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.motion_check import check_motions
from handeye_cli.noise_levels import NoiseModel, noise_model
from handeye_cli.predict import noise_freedom, solution_covariance
from handeye_cli.records import Camera, FloatArray, Noise, Stations
from handeye_cli.seen_through import chain_through
from handeye_cli.solvers.problem import Solution
from handeye_cli.solvers.station_mean import mean_target


@dataclass(frozen=True)
class PartCalibration:
    """The answer of n stations, with the target where they see it on average (paper, step 2).

    Attributes:
        part: The stations.
        solution: X, and Z as the mean over the stations.
        influence: (n, 12 + q, 12) how X, Z and the q errors which all stations share, as far as
            they were refined, move with each station's poses.
        shared: (12 + q, 12 + q) covariance that these errors cause, of X, Z and themselves
            (`Chain.by_causes`).
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
        """(12 + q, 12 + q) covariance of X, Z and the errors that all stations share."""
        return self.shared + solution_covariance(self.influence, self.model.covariance)

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
    part = chain_through(stations, part, found.camera)
    averaged = Solution(found.solution.X, mean_target(part.A, part.B, found.solution.X))
    loop = loop_jacobians(part.A, part.B, averaged.X, averaged.Z)
    moves = _with_target(loop.by_unknowns[..., :6], part.by_shared_causes(loop))
    influence = moves @ np.concatenate([found.influence[:, :6], found.causes_influence], axis=1)
    influence[:, 6:12] += loop.by_poses / len(part.A)
    across = found.with_causes[:6]
    joint = np.block([[found.shared[:6, :6], across], [across.T, found.causes]])
    shared = moves @ joint @ moves.T
    return PartCalibration(part, averaged, influence, shared, found.model, found.camera)


def _with_target(by_answer: FloatArray, by_causes: FloatArray) -> FloatArray:
    """Return (12 + q, 6 + q): what X and the shared errors make of X, the mean Z and themselves.

    Args:
        by_answer: (n, 6, 6) how what each station sees of Z moves with X.
        by_causes: (n, 6, q) how it moves with the errors.
    """
    size = by_causes.shape[-1]
    moves = np.eye(12 + size, 6 + size, k=-6)
    moves[:6, :6] = np.eye(6)
    moves[6:12] = np.concatenate([by_answer, by_causes], axis=-1).mean(axis=0)
    return moves


def noise_of_others(
    others: Chain, given: Noise | None, known: Noise, solution: Solution
) -> FloatArray:
    """Return the (M, 12, 12) covariances of stations that took no part in a calibration.

    What these stations share with each other, or with the calibration, is not among them.

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
    return noise_model(others, levels, solution).covariance


def _first(level: float | None, otherwise: float | None) -> float:
    return level if level is not None else otherwise or 0.0
