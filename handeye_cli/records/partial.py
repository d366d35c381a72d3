"""The answer as far as the data determine it, and what they leave free."""

from __future__ import annotations

from dataclasses import dataclass

from handeye_cli.conventions import Setup
from handeye_cli.records.basics import FloatArray, Noise, UncertainPose
from handeye_cli.records.free import FreeDirection
from handeye_cli.records.results import PredictedError


@dataclass(frozen=True)
class PartialAnswer:
    """The part of the answer that the data determine; the rest is held at a choice.

    Free translations of `mount_T_camera` are those of a guess along their directions, and a free
    rotation is the one nearest to the guess's; the guess is the identity where none was given.

    Attributes:
        setup: Names the frames of the two poses.
        mount_T_camera: `gripper_T_camera`, or `base_T_camera` for eye-to-hand.
        reference_T_target: `base_T_target`, or `gripper_T_target` for eye-to-hand; it belongs to
            the choice.
        covariance: (12, 12) of both, with the free directions held: zero along them.
        free: What is not determined; nothing when all is.
        predicted_error: Expected error of `mount_T_camera` over the determined directions only.
        noise: The levels the prediction rests on.
        noise_estimated: True where they were estimated from the residuals.
        noise_freedom: Degrees of freedom of that estimate, or None when it was given.
        residuals: (N, 6) of the loops of the stations that were used: metres, then radians.
    """

    setup: Setup
    mount_T_camera: UncertainPose
    reference_T_target: UncertainPose
    covariance: FloatArray
    free: tuple[FreeDirection, ...]
    predicted_error: PredictedError
    noise: Noise
    noise_estimated: bool
    noise_freedom: float | None
    residuals: FloatArray
