"""Checks of flags and documents that cost nothing, made before the work that costs."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from handeye_cli.conventions import parse_length
from handeye_cli.errors import InputError, UsageError

if TYPE_CHECKING:
    from handeye_cli.cli.verification_options import Protocol
    from handeye_cli.records import Calibration

_FARTHEST = 100.0
"""Metres; a longer distance is a slip of the hand."""


def check_protocol(protocol: Protocol) -> None:
    """Refuse flags that name two protocols, or have none to act on.

    Raises:
        UsageError: Two of them exclude each other, or one of them needs another.
    """
    named = {
        "--stations": protocol.stations is not None,
        "--leave-one-out": protocol.leave_one_out,
        "--calibration": protocol.calibration is not None,
    }
    given = [flag for flag, is_given in named.items() if is_given]
    if len(given) > 1:
        raise UsageError(
            f"{' and '.join(given)} exclude each other: --stations and --leave-one-out calibrate "
            "anew, --calibration checks an answer that is there",
            hint="keep one of them",
        )
    if protocol.target_moved and protocol.calibration is None:
        raise UsageError(
            "--target-moved acts on --calibration only: within one recording the target must stay "
            "in place",
            hint="leave it out, or name the calibration with --calibration FILE",
        )


def station_counts(protocol: Protocol) -> list[int] | None:
    """Return the station counts of `--stations 4,6,8`, or None when it was not given.

    Raises:
        UsageError: It is no list of numbers.
    """
    text = protocol.stations
    if text is None:
        return None
    if not re.fullmatch(r"\s*\d+\s*(,\s*\d+\s*)*", text):
        raise UsageError(
            f"expected --stations to be whole numbers with commas, found {text!r}",
            hint="write them as 4,6,8,10,12",
        )
    return [int(word) for word in text.split(",")]


def distance_of(text: str) -> float:
    """Read a distance from camera to target with its unit, such as `170mm`, into metres.

    Raises:
        UsageError: The number or its unit is missing or unknown, or no target is so far away.
    """
    distance = parse_length(text)
    if distance > _FARTHEST:
        raise UsageError(
            f"expected --distance to be at most {_FARTHEST:g} m, found {text!r}",
            hint="write it with its unit, such as 170mm",
        )
    return distance


def require_whole(calibration: Calibration) -> None:
    """Refuse an answer of which a direction is a choice and not a measurement.

    Raises:
        InputError: The data left some of it free.
    """
    if calibration.free:
        found = ", ".join(each.words for each in calibration.free)
        raise InputError(
            f"expected a whole answer, found a partial one, which leaves free: {found}",
            hint="add stations that determine it, and solve without --partial",
        )
