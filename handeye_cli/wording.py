"""Wordings that more than one room needs."""

from __future__ import annotations

from collections.abc import Sequence


def first_few(names: Sequence[str], most: int) -> str:
    """Return the first names of a list, and how many more there are: `a, b and 3 more`.

    Args:
        names: At least one.
        most: How many are named.
    """
    named = ", ".join(names[:most])
    return f"{named} and {len(names) - most} more" if len(names) > most else named
