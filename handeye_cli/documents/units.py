"""Unit-suffixed numbers of documents: mrad, mm and ms outside; radians, metres, seconds inside.

The factor of a thousand is applied to the decimal digits. Multiplying the binary numbers instead
would turn 0.81 mrad into 0.0008100000000000001 rad, and would lose the last bit of one number in
forty on the way out and back.
"""

from __future__ import annotations

from decimal import Decimal
from typing import Any


def to_milli(value: float) -> Decimal:
    """Return a value in radians, metres or seconds as the exact number of mrad, mm or ms."""
    return Decimal(repr(float(value))).scaleb(3)


def from_milli(number: float | Decimal) -> float:
    """Return a number of mrad, mm or ms in radians, metres or seconds; undoes `to_milli`."""
    return float(Decimal(str(number)).scaleb(-3))


def with_floats(value: Any) -> Any:
    """Return plain data of a document with every decimal number as a float."""
    if isinstance(value, Decimal):
        return float(value)
    if isinstance(value, dict):
        return {key: with_floats(item) for key, item in value.items()}
    if isinstance(value, list):
        return [with_floats(item) for item in value]
    return value
