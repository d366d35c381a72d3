"""What an estimation hands on to whatever judges or reports it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handeye_cli.noise_levels import NoiseModel
from handeye_cli.predict import solution_covariance
from handeye_cli.records import Camera, Finding, FloatArray
from handeye_cli.solvers.problem import Solution


@dataclass(frozen=True)
class Estimate:
    """The answer of one method, with all that its error consists of.

    Attributes:
        solution: X and Z.
        residuals: (N, 6) of the stations' loops.
        model: The noise of the stations' poses.
        influence: (N, 12, 12) how X and Z move with each station's poses.
        shared: (12, 12) covariance of X and Z that the q errors which all stations share cause,
            those of the intrinsics and of the robot poses.
        with_causes: (12, q) covariance, from the same causes, of X and Z with these errors, in the
            units of `Chain.by_causes`.
        causes: (q, q) covariance of these errors themselves, likewise.
        causes_influence: (N, q, 12) how what is left of them moves with each station's poses: zero
            but for intrinsics that were refined.
        camera: The intrinsics, refined where they were uncertain.
        findings: What the estimation has to say about the data.
    """

    solution: Solution
    residuals: FloatArray
    model: NoiseModel
    influence: FloatArray
    shared: FloatArray
    with_causes: FloatArray
    causes: FloatArray
    causes_influence: FloatArray
    camera: Camera | None = None
    findings: tuple[Finding, ...] = ()

    @property
    def covariance(self) -> FloatArray:
        """(12, 12) covariance of X and Z from all causes."""
        return np.asarray(solution_covariance(self.influence, self.model.covariance) + self.shared)
