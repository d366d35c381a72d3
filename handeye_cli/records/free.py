"""Directions of the answer that the data leave free."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from handeye_cli.records.basics import FloatArray


class PosePart(StrEnum):
    """A half of a pose."""

    ROTATION = "rotation"
    TRANSLATION = "translation"


@dataclass(frozen=True)
class FreeDirection:
    """A direction of `mount_T_camera` that the data do not determine.

    Attributes:
        part: What is free: the rotation about the direction, or the translation along it.
        direction: (3,) unit vector.
        frame: The frame it is in, `gripper` or `base`.
        words: The same for people.
    """

    part: PosePart
    direction: FloatArray
    frame: str
    words: str
