"""The stations of an answer as the tests of its residuals take them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.conventions import Setup
from handeye_cli.estimates import Estimate
from handeye_cli.geometry import se3, smooth_fields
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.geometry.smooth_fields import WhiteResiduals
from handeye_cli.records import FloatArray, IntArray

PARTS = {"translation": slice(0, 3), "rotation": slice(3, 6)}
"""Of a perturbation."""
_MOST = 24
"""Stations, spread over all, of which each is compared with each."""


@dataclass(frozen=True)
class AnsweredStations:
    """N stations of an answer.

    Attributes:
        estimate: The answer.
        robot: (N, 4, 4) base_T_gripper.
        target: (N, 3) positions of the target in the camera.
        residuals: (N, 6) of the loops.
        spread: (N, 6, 6) their covariance.
        fitted: (N, 6, q) their derivative by what was fitted.
        by_robot: (N, 6, 6) by the perturbation of base_T_gripper.
        from_camera: (N, 6, 6) part of `spread` that is the camera's.
        to_mount: (N, 6, 6) derivative of A's perturbation by that of base_T_gripper.
        influence: (N, 12, 6) of base_T_gripper on X and Z.
        in_motion: Whether the robot was seen along its way.
    """

    estimate: Estimate
    robot: FloatArray
    target: FloatArray
    residuals: FloatArray
    spread: FloatArray
    fitted: FloatArray
    by_robot: FloatArray
    from_camera: FloatArray
    to_mount: FloatArray
    influence: FloatArray
    in_motion: bool

    @classmethod
    def of(cls, estimate: Estimate, chain: Chain, setup: Setup) -> AnsweredStations:
        """Collect them; the arguments are those of `systematic_errors`."""
        X, Z = estimate.solution.X, estimate.solution.Z
        loop = loop_jacobians(chain.A, chain.B, X, Z)
        return cls(
            estimate=estimate,
            robot=chain.A if setup is Setup.EYE_IN_HAND else se3.inverse(chain.A),
            target=chain.B[:, :3, 3],
            residuals=estimate.residuals,
            spread=carried(loop.by_poses, estimate.model.covariance),
            fitted=np.concatenate([loop.by_unknowns, chain.by_shared_causes(loop)], axis=-1),
            by_robot=loop.by_robot @ chain.by_robot,
            from_camera=carried(loop.by_camera, estimate.model.covariance[:, 6:, 6:]),
            to_mount=chain.by_robot,
            influence=estimate.influence[..., :6] @ chain.by_robot,
            in_motion=chain.shared_error is not None and bool(np.any(chain.shared_error)),
        )

    def white(self) -> WhiteResiduals:
        """Return the residuals with unit variance."""
        return smooth_fields.whitened(self.residuals, self.spread, self.fitted, self.by_robot)

    def part(self, rows: IntArray) -> AnsweredStations:
        """Return some of the stations; the estimate remains that of all."""
        arrays = {
            name: getattr(self, name)[rows]
            for name in AnsweredStations.__annotations__
            if name not in ("estimate", "in_motion")
        }
        return replace(self, **arrays)

    def few(self) -> AnsweredStations:
        """Return at most so many stations as can be compared in pairs, spread over all."""
        count = len(self.robot)
        rows = np.linspace(0, count - 1, min(count, _MOST)).round().astype(int)
        return self.part(rows)


def carried(J: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return the (N, k, k) covariances `J C J'` of what (N, k, l) derivatives make of errors."""
    return np.asarray(J @ covariance @ np.swapaxes(J, -1, -2))
