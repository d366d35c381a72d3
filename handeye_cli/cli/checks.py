"""Checks of flags that cost nothing, made before the work that costs."""

from __future__ import annotations

import re

from handeye_cli.cli.options import Protocol
from handeye_cli.errors import UsageError


def station_counts(protocol: Protocol) -> list[int] | None:
    """Return the station counts of `--stations 4,6,8`, or None when it was not given.

    Raises:
        UsageError: It is no list of numbers, or there is nothing to calibrate with.
    """
    text = protocol.stations
    if text is None:
        return None
    if protocol.calibration is not None:
        raise UsageError(
            "--stations and --calibration exclude each other: the first calibrates anew, the "
            "second checks an answer that is there",
            hint="leave one of them out",
        )
    if not re.fullmatch(r"\s*\d+\s*(,\s*\d+\s*)*", text):
        raise UsageError(
            f"expected --stations to be whole numbers with commas, found {text!r}",
            hint="write them as 4,6,8,10,12",
        )
    return [int(word) for word in text.split(",")]
