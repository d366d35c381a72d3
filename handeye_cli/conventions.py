"""The words and units everything else is written in; standard library only.

Frames: `A_T_B` is the pose of frame B in frame A, `p_A = A_T_B @ p_B`, so neighbours cancel:
`base_T_target = base_T_gripper @ gripper_T_camera @ camera_T_target`.

Both setups are one equation for the kernels. The camera is fixed to the *mount* and the target to
the *reference*, and for every station

    reference_T_mount @ mount_T_camera @ camera_T_target = reference_T_target

eye-in-hand: mount = gripper, reference = base;
eye-to-hand: mount = base, reference = gripper.

Inside: metres, radians, nanoseconds. For people: mm, mrad, and mil in the paper's table.
"""

from __future__ import annotations

import math
import re
from enum import StrEnum

from handeye_cli.errors import UsageError

MM = 1e-3
"""Metres in a millimetre."""
MRAD = 1e-3
"""Radians in a milliradian."""
MIL = 25.4e-6
"""Metres in a thousandth of an inch, the paper's unit of length."""


class Setup(StrEnum):
    """Where the camera is fixed."""

    EYE_IN_HAND = "eye-in-hand"
    EYE_TO_HAND = "eye-to-hand"

    @property
    def mount(self) -> str:
        """Frame the camera is fixed to."""
        return "gripper" if self is Setup.EYE_IN_HAND else "base"

    @property
    def reference(self) -> str:
        """Frame the target is fixed to."""
        return "base" if self is Setup.EYE_IN_HAND else "gripper"

    @property
    def answer(self) -> str:
        """Name of the transform that is looked for."""
        return f"{self.mount}_T_camera"

    @property
    def constant(self) -> str:
        """Name of the transform that comes with it."""
        return f"{self.reference}_T_target"


class PoseUnits(StrEnum):
    """Unit of the translations in a document."""

    M = "m"
    MM = "mm"

    @property
    def metres(self) -> float:
        """Metres in one unit."""
        return MM if self is PoseUnits.MM else 1.0


class QuaternionOrder(StrEnum):
    """Order of a quaternion's numbers in a document."""

    XYZW = "xyzw"
    WXYZ = "wxyz"


class RobotPoses(StrEnum):
    """Direction of the robot's poses in a document."""

    GRIPPER_IN_BASE = "gripper-in-base"
    BASE_IN_GRIPPER = "base-in-gripper"


_LENGTHS = {"um": 1e-6, "mil": MIL, "mm": MM, "cm": 1e-2, "m": 1.0, "in": 0.0254}
_ANGLES = {"mrad": MRAD, "rad": 1.0, "deg": math.pi / 180.0}
_TIMES = {"ns": 1, "us": 1_000, "ms": 1_000_000, "s": 1_000_000_000}
_LARGEST = 4e18
"""Metres, radians or nanoseconds: a time and a stamp still add up to 64 bits."""
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([a-zA-Z]*)\s*")


def _quantity(text: str, units: dict[str, float] | dict[str, int], example: str) -> float:
    match = _QUANTITY.fullmatch(text)
    number, unit = match.groups() if match else ("nan", "")
    if unit not in units or not abs(float(number)) * units[unit] <= _LARGEST:
        known = ", ".join(units)
        raise UsageError(
            f"expected a number with one of the units {known}, found {text!r}",
            hint=f"write it as {example}",
        )
    return float(number) * units[unit]


def parse_length(text: str) -> float:
    """Read a length with its unit, such as `170mm`, into metres.

    Raises:
        UsageError: The number or its unit is missing or unknown.
    """
    return _quantity(text, _LENGTHS, "170mm")


def parse_angle(text: str) -> float:
    """Read an angle with its unit, such as `30deg`, into radians.

    Raises:
        UsageError: The number or its unit is missing or unknown.
    """
    return _quantity(text, _ANGLES, "30deg")


def parse_duration(text: str) -> int:
    """Read a time with its unit, such as `40ms`, into nanoseconds.

    Raises:
        UsageError: The number or its unit is missing or unknown.
    """
    return round(_quantity(text, _TIMES, "40ms"))
