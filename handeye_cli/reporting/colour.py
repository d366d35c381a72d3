"""The colours of a traffic light."""

from __future__ import annotations

from enum import StrEnum


class Colour(StrEnum):
    """What to do with an answer: leave it, look at it again, or use it."""

    RED = "red"
    AMBER = "amber"
    GREEN = "green"
