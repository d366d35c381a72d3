"""What limits a calibration and what would improve it, as they stand in its document.

Angles are written in degrees, so they come back as they were but for a rounding in the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from handeye_cli.documents import parts
from handeye_cli.documents.units import from_milli, to_milli
from handeye_cli.records import CriticalFactors, Improvement, Spread

_PARTS = ("", "_smallest", "_largest")
"""What a key adds to its name for each value of a spread; the median is the quantity itself."""


def factors_from_data(data: dict[str, Any] | None) -> CriticalFactors | None:
    """Return the factors of a `factors:` mapping, or None without one."""
    if data is None:
        return None
    return CriticalFactors(
        stations=int(data["stations"]),
        axes_angle=_spread(data, "axes_angle{}_deg", math.radians),
        interstation_angle=_spread(data, "interstation_angle{}_deg", math.radians),
        camera_distance=_spread(data, "camera_distance{}_mm", from_milli),
        gripper_distance=_spread(data, "gripper_distance{}_mm", from_milli),
        robot_share_rotation=_share(data, "robot_share_rotation"),
        robot_share_translation=_share(data, "robot_share_translation"),
    )


def data_from_factors(factors: CriticalFactors | None) -> dict[str, Any] | None:
    """Return factors as a `factors:` mapping, or None when there are none."""
    if factors is None:
        return None
    return parts.without_unknown(
        {
            "stations": factors.stations,
            **_entries(factors.axes_angle, "axes_angle{}_deg", math.degrees),
            **_entries(factors.interstation_angle, "interstation_angle{}_deg", math.degrees),
            **_entries(factors.camera_distance, "camera_distance{}_mm", to_milli),
            **_entries(factors.gripper_distance, "gripper_distance{}_mm", to_milli),
            "robot_share_rotation": factors.robot_share_rotation,
            "robot_share_translation": factors.robot_share_translation,
        }
    )


def improvements_from_data(data: list[dict[str, Any]]) -> tuple[Improvement, ...]:
    """Return the improvements of an `improvements:` list."""
    return tuple(
        Improvement(
            change=item["change"],
            action=item["action"],
            rotation=from_milli(item["rotation_mrad"]),
            translation=from_milli(item["translation_mm"]),
            message=item["message"],
        )
        for item in data
    )


def data_from_improvements(improvements: Sequence[Improvement]) -> list[dict[str, Any]] | None:
    """Return improvements as a list, or None when there are none."""
    return [
        {
            "change": improvement.change,
            "action": improvement.action,
            "rotation_mrad": to_milli(improvement.rotation),
            "translation_mm": to_milli(improvement.translation),
            "message": improvement.message,
        }
        for improvement in improvements
    ] or None


def _share(data: dict[str, Any], key: str) -> float | None:
    return float(data[key]) if key in data else None


def _spread(data: dict[str, Any], key: str, read: Callable[[Any], float]) -> Spread:
    return Spread(*(read(data[key.format(part)]) for part in _PARTS))


def _entries(spread: Spread, key: str, write: Callable[[float], Any]) -> dict[str, Any]:
    values = (spread.median, spread.smallest, spread.largest)
    return {key.format(part): write(value) for part, value in zip(_PARTS, values, strict=True)}
