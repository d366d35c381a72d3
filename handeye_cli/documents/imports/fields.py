"""Values of other tools' files, checked for their shape, with the place of what is wrong."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from handeye_cli.documents.cameras.intrinsics import number
from handeye_cli.documents.complaints import describe
from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError


def mapping(value: Any, place: Place) -> dict[str, Any]:
    """Return a mapping.

    Raises:
        InputError: It is none.
    """
    if not isinstance(value, dict):
        raise InputError(f"expected a mapping, found {describe(value)}", where=str(place))
    return value


def entries(value: Any, place: Place) -> list[Any]:
    """Return a list that is not empty.

    Raises:
        InputError: It is no list, or has no entries.
    """
    if not isinstance(value, list) or not value:
        found = describe(value)
        raise InputError(f"expected a list of at least one entry, found {found}", where=str(place))
    return value


def words(value: Any, place: Place) -> str:
    """Return a text that is not empty.

    Raises:
        InputError: It is none.
    """
    if not isinstance(value, str) or not value:
        raise InputError(f"expected a text, found {describe(value)}", where=str(place))
    return value


def value_of(data: Any, key: str, place: Place) -> Any:
    """Return the value of a key that must be there.

    Raises:
        InputError: The data are no mapping, or the key is missing.
    """
    inside = mapping(data, place)
    if key not in inside:
        message = f"expected the key {key!r}, found {describe(inside)}"
        raise InputError(message, where=str(place))
    return inside[key]


def numbers_of(data: Any, keys: Sequence[str], place: Place) -> list[float]:
    """Return the numbers of keys that must be there.

    Raises:
        InputError: A key is missing, or its value is no number.
    """
    return [number(value_of(data, key, place), place.key(key)) for key in keys]
