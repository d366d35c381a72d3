"""Numbers and names as people read them: mm, mrad, degrees, and nothing a terminal would obey."""

from __future__ import annotations

import math

import numpy as np

from handeye_cli.conventions import MIL, MM, MRAD
from handeye_cli.records import FloatArray

NOTHING = "-"
"""Stands where there is no number."""


def mm(metres: float | None) -> str:
    """Return a length in mm, three decimals."""
    return NOTHING if metres is None else f"{metres / MM:.3f}"


def mil(metres: float | None) -> str:
    """Return a length in mil (0.0254 mm), the unit of the paper's table."""
    return NOTHING if metres is None else f"{metres / MIL:.3f}"


def mrad(radians: float | None) -> str:
    """Return a small angle in mrad, three decimals."""
    return NOTHING if radians is None else f"{radians / MRAD:.3f}"


def deg(radians: float) -> str:
    """Return an angle in degrees, two decimals."""
    return f"{math.degrees(radians):.2f}"


def pixels(value: float | None) -> str:
    """Return a length in the image, three decimals."""
    return NOTHING if value is None else f"{value:.3f}"


def fixed(values: FloatArray, decimals: int) -> list[str]:
    """Return (n,) numbers, already in the unit they are shown in, with fixed decimals."""
    # Adding zero turns a negative zero, which would show as -0.000, into a positive one.
    return [f"{value:.{decimals}f}" for value in np.round(values, decimals) + 0.0]


def printable(text: str) -> str:
    """Return text from a file with the characters a terminal would obey made visible."""
    return "".join(sign if sign.isprintable() else "\N{REPLACEMENT CHARACTER}" for sign in text)


def count(number: int, noun: str) -> str:
    """Return a number with its regular noun: `1 station`, `7 stations`."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
