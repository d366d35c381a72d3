"""What the texts of the flags of `handeye plan` mean."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from handeye_cli.cli.plan_options import CellLimits, Levels
from handeye_cli.conventions import MM, MRAD, parse_angle, parse_length
from handeye_cli.errors import UsageError

if TYPE_CHECKING:
    from handeye_cli.planning.options import Limits
    from handeye_cli.records import FloatArray, Noise


def limits_of(flags: CellLimits) -> Limits:
    """Return the limits that flags set.

    Raises:
        UsageError: A text is not what its flag takes.
    """
    from handeye_cli.planning.options import Limits

    return Limits(
        margin=flags.margin_px,
        depth=None if flags.depth is None else _depth(flags.depth),
        max_tilt=_angle("max-tilt", flags.max_tilt, 80.0),
        max_roll=_angle("max-roll", flags.max_roll, 180.0),
        box=None if flags.box is None else _box(flags.box),
        reach=None if flags.reach is None else _positive("reach", parse_length(flags.reach)),
        cone=None if flags.cone is None else _cone(flags.cone),
        avoid_axis=None if flags.avoid_axis is None else _axis(flags.avoid_axis),
        min_rotation=_angle("min-rotation", flags.min_rotation, 180.0),
    )


def noise_of(flags: Levels) -> Noise:
    """Return the noise levels that flags state."""
    from handeye_cli.records import Noise

    def scaled(level: float | None, unit: float) -> float | None:
        return None if level is None else level * unit

    return Noise(
        scaled(flags.robot_rotation_mrad, MRAD),
        scaled(flags.robot_translation_mm, MM),
        scaled(flags.camera_rotation_mrad, MRAD),
        scaled(flags.camera_translation_mm, MM),
        flags.pixel_noise,
    )


def lever_of(flags: Levels) -> float:
    """Return the lever in metres.

    Raises:
        UsageError: It is no length, or negative.
    """
    length = parse_length(flags.lever)
    if length < 0.0:
        raise UsageError(f"expected --lever to be at least 0 mm, found {flags.lever}")
    return length


def _angle(flag: str, text: str | None, most: float) -> float | None:
    if text is None:
        return None
    angle = parse_angle(text)
    if not 0.0 <= angle <= math.radians(most) + 1e-12:
        raise UsageError(f"expected --{flag} to be 0 to {most:g} deg, found {text}")
    return angle


def _positive(flag: str, length: float) -> float:
    if length <= 0.0:
        raise UsageError(f"expected --{flag} to be above 0 mm, found {length / MM:g} mm")
    return length


def _depth(text: str) -> tuple[float, float]:
    words = text.split(",")
    if len(words) != 2:
        raise UsageError(
            f"expected --depth to be two lengths, found {text!r}", hint="write it as 150mm,250mm"
        )
    near, far = _lengths(words)
    if not 0.0 < near <= far:
        raise UsageError(
            f"expected --depth to rise from above 0, found {near / MM:g} to {far / MM:g} mm"
        )
    return near, far


def _lengths(words: list[str]) -> list[float]:
    """Return lengths of which each has a unit, or only the last one, which then holds for all."""
    unit = re.sub(r"^[^a-zA-Z]*", "", words[-1].strip())
    bare = re.compile(r"\s*[-+]?[\d.]+\s*")
    return [parse_length(word + unit if bare.fullmatch(word) else word) for word in words]


def _box(text: str) -> FloatArray:
    import numpy as np

    words = text.split(",")
    if len(words) != 6:
        raise UsageError(
            f"expected --box to be six lengths, found {text!r}",
            hint="write it as x0,y0,z0,x1,y1,z1: 200,-300,100,800,300,600mm",
        )
    box = np.array(_lengths(words)).reshape(2, 3)
    if np.any(box[0] > box[1]):
        axis = "xyz"[int(np.argmax(box[0] > box[1]))]
        raise UsageError(
            f"expected --box to give the smaller {axis} first, found {text}",
            hint="first the corner with the smallest x, y and z, then that with the largest",
        )
    return box


def _cone(text: str) -> FloatArray:
    import numpy as np

    words = text.split(",")
    numbers = words[:3]
    if len(words) != 4 or not all(re.fullmatch(r"\s*[-+]?\d*\.?\d+\s*", each) for each in numbers):
        raise UsageError(
            f"expected --cone to be a direction and an angle, found {text!r}",
            hint="write it as 0,0,-1,60deg: the gripper's z axis points down, within 60 degrees",
        )
    direction = [float(each) for each in numbers]
    if not any(direction):
        raise UsageError(f"expected --cone to have a direction, found {text}")
    return np.array([*direction, _angle("cone", words[3], 180.0)])


def _axis(text: str) -> tuple[int, float]:
    name, comma, angle = text.partition(",")
    if name not in ("x", "y", "z"):
        raise UsageError(
            f"expected --avoid-axis to be x, y or z, found {name!r}", hint="write it as x or x,5deg"
        )
    most = _angle("avoid-axis", angle if comma else "10deg", 180.0)
    return "xyz".index(name), most or 0.0
