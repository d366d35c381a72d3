"""The two halves of an error, each in a figure of its own."""

from __future__ import annotations

from dataclasses import dataclass

from handeye_cli.conventions import MM, MRAD


@dataclass(frozen=True)
class Quantity:
    """A half of an error.

    Attributes:
        name: Name of the field in records.
        unit: One of its unit for people, in that of the records.
        sign: Name of that unit.
    """

    name: str
    unit: float
    sign: str

    @property
    def label(self) -> str:
        """What stands beside an axis."""
        return f"{self.name} [{self.sign}]"


QUANTITIES = (Quantity("rotation", MRAD, "mrad"), Quantity("translation", MM, "mm"))
"""Rotation first, as in every table."""
