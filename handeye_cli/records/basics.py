"""The small records that the others are made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from handeye_cli.geometry.camera import Lens

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
GreyImage = NDArray[np.uint8]


@dataclass(frozen=True)
class UncertainPose:
    """A pose and, where it is known, its covariance.

    Attributes:
        matrix: (4, 4) homogeneous transform.
        covariance: (6, 6), or None when unknown.
    """

    matrix: FloatArray
    covariance: FloatArray | None = None


@dataclass(frozen=True)
class Camera:
    """Intrinsics of a camera, pixel (0, 0) being the centre of the top-left pixel.

    Attributes:
        width: Image width in pixels.
        height: Image height in pixels.
        fx: Focal length along x in pixels.
        fy: Focal length along y in pixels.
        cx: Principal point x in pixels.
        cy: Principal point y in pixels.
        distortion: Coefficients in OpenCV's order for the model.
        model: `plumb_bob`, `rational_polynomial` or `equidistant`, as in ROS.
        covariance: (4 + k, 4 + k) of (fx, fy, cx, cy, *distortion), or None when taken as exact.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()
    model: str = "plumb_bob"
    covariance: FloatArray | None = None

    @property
    def parameters(self) -> FloatArray:
        """(4 + k,) array of fx, fy, cx, cy and the distortion."""
        return np.array([self.fx, self.fy, self.cx, self.cy, *self.distortion])

    @property
    def lens(self) -> Lens:
        """The intrinsics as the kernels take them."""
        from handeye_cli.geometry.camera import Lens

        return Lens(self.parameters, self.model)


@dataclass(frozen=True)
class TargetSpec:
    """What the calibration target is, as a document or `--target` says it.

    Attributes:
        type: A row of the table of targets, such as `disc-grid`.
        parameters: The keys of that type, with their units in their names.
    """

    type: str
    parameters: Mapping[str, float | int | str | bool] = field(default_factory=dict)


@dataclass(frozen=True)
class Noise:
    """Noise levels as RMS magnitudes; None where unknown.

    Attributes:
        robot_rotation: Of `base_T_gripper`, radians.
        robot_translation: Of `base_T_gripper`, metres.
        camera_rotation: Of `camera_T_target`, radians.
        camera_translation: Of `camera_T_target`, metres.
        pixel: Of one image coordinate, pixels (a standard deviation, not a magnitude).
    """

    robot_rotation: float | None = None
    robot_translation: float | None = None
    camera_rotation: float | None = None
    camera_translation: float | None = None
    pixel: float | None = None


@dataclass(frozen=True)
class ProvenanceStep:
    """One command that led to a document.

    Attributes:
        command: Such as `solve`.
        version: Version of the tool.
        inputs: Pairs of file name and SHA-256 in hex.
        options: The flags that were given.
    """

    command: str
    version: str
    inputs: tuple[tuple[str, str], ...] = ()
    options: Mapping[str, Any] = field(default_factory=dict)


GRAVITY = ("error", "warning", "info")
"""The severities of findings, the gravest first."""


@dataclass(frozen=True)
class Finding:
    """Something the user should know about the data.

    Attributes:
        code: Stable short name in kebab-case.
        severity: One of `GRAVITY`.
        message: What was seen, with numbers.
        advice: The next step.
    """

    code: str
    severity: str
    message: str
    advice: str = ""
