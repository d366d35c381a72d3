"""Wordings that more than one room needs."""

from __future__ import annotations

from collections.abc import Sequence

from handeye_cli.conventions import MM, MRAD

CALIBRATE_AGAIN = "'handeye solve RECORDING --calibrate-intrinsics', or calibrate the camera again"
"""The next step where intrinsics were given that the pixels contradict."""


def first_few(names: Sequence[str], most: int) -> str:
    """Return the first names of a list, and how many more there are: `a, b and 3 more`.

    Args:
        names: At least one.
        most: How many are named.
    """
    named = ", ".join(names[:most])
    return f"{named} and {len(names) - most} more" if len(names) > most else named


def error_sizes(rotation: float, translation: float) -> str:
    """Return errors for people: `0.123 mrad and 0.045 mm`.

    Args:
        rotation: Radians.
        translation: Metres.
    """
    return f"{rotation / MRAD:.3f} mrad and {translation / MM:.3f} mm"
