"""Directions that the data leave free, as they stand in documents."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from handeye_cli.records import FreeDirection, PosePart


def free_from_data(data: list[dict[str, Any]]) -> tuple[FreeDirection, ...]:
    """Return the directions of a `free:` list."""
    return tuple(
        FreeDirection(
            part=PosePart(item["part"]),
            direction=np.array(item["direction"], dtype=float),
            frame=item["frame"],
            words=item["words"],
        )
        for item in data
    )


def data_from_free(free: Sequence[FreeDirection]) -> list[dict[str, Any]] | None:
    """Return free directions as a list, or None when there are none."""
    return [
        {
            "part": str(each.part),
            "direction": (each.direction + 0.0).tolist(),
            "frame": each.frame,
            "words": each.words,
        }
        for each in free
    ] or None
