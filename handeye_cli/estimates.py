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
        with_intrinsics: (12, m) covariance of X and Z with the m errors of unit variance in the
            intrinsics of `camera`; those of `Chain.by_intrinsics` for poses that rest on it.
        shared: (12, 12) covariance of X and Z that the intrinsics, and an error that all robot
            poses share, cause.
        camera: The intrinsics, refined where they were uncertain.
        findings: What the estimation has to say about the data.
    """

    solution: Solution
    residuals: FloatArray
    model: NoiseModel
    influence: FloatArray
    with_intrinsics: FloatArray
    shared: FloatArray
    camera: Camera | None = None
    findings: tuple[Finding, ...] = ()

    @property
    def covariance(self) -> FloatArray:
        """(12, 12) covariance of X and Z from all causes."""
        return np.asarray(solution_covariance(self.influence, self.model.covariance) + self.shared)
