"""A calibration's answer between two named frames, as it leaves for other software."""

from __future__ import annotations

from dataclasses import dataclass

from handeye_cli.conventions import Setup
from handeye_cli.records.basics import Camera, FloatArray


@dataclass(frozen=True)
class NamedTransform:
    """The pose of one named frame in another.

    Attributes:
        parent: Name of the frame the camera is fixed to.
        child: Name of the camera's optical frame, or of its mount link.
        matrix: (4, 4) `parent_T_child`, metres.
        setup: Whether the parent is the gripper or the base.
        covariance: (6, 6) of `matrix`, perturbed in the parent frame, or None when unknown.
        camera: Intrinsics of the child, or None when unknown or when it is no optical frame.
        optical: Whether the child is the optical frame.
        name: What software that keeps several calibrations files this one under.
    """

    parent: str
    child: str
    matrix: FloatArray
    setup: Setup
    covariance: FloatArray | None = None
    camera: Camera | None = None
    optical: bool = True
    name: str = "handeye"
