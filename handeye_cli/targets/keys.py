"""The keys of a target, read off the fields of its board class and checked against them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

from handeye_cli.errors import InputError, did_you_mean
from handeye_cli.targets.board import Board

BoardT = TypeVar("BoardT", bound=Board)

_EXPECTED = {int: "a whole number", float: "a length in mm", str: "a name", bool: "true or false"}
_ACCEPTED: dict[type, tuple[type, ...]] = {
    int: (int,),
    float: (int, float),
    str: (str,),
    bool: (bool,),
}

_LENGTHS_MM = (1e-6, 1e6)
_MOST_POINTS = 5000
"""Discs or corners that are looked for in an image, at most."""


@dataclass(frozen=True)
class Range:
    """What a whole number may be, as `Annotated[int, Range(2)]` in a board class.

    Attributes:
        least: Smallest value.
        most: Largest value; that of a number of columns or rows, unless given.
    """

    least: int
    most: int = 1000


@dataclass(frozen=True)
class Key:
    """One key of a type of target.

    Attributes:
        name: As in a document.
        kind: `int`, `float` (a length in mm), `str` or `bool`.
        required: Whether it must be there.
        limits: What a whole number may be.
    """

    name: str
    kind: type
    required: bool
    limits: Range


def keys_of(board: type[Board]) -> dict[str, Key]:
    """Return the keys of a board class by their names, in the order of its fields."""
    hints = get_type_hints(board, include_extras=True)
    return {each.name: _key(each.name, hints[each.name], each.default) for each in fields(board)}


def _key(name: str, hint: Any, default: Any) -> Key:
    limits = Range(0, 2**31 - 1)
    if get_origin(hint) is Annotated:
        hint, limits = get_args(hint)
    # `float | None` is a length that may be left out
    kind = next(iter(get_args(hint)), hint)
    return Key(name, kind, default is MISSING, limits)


def refuse(message: str, hint: str | None = None) -> InputError:
    """Return the error of a target that is not valid."""
    return InputError(message, where="target", hint=hint)


def require_few(columns: int, rows: int, points: str) -> None:
    """Check that a target has no more points than are looked for in an image.

    Args:
        columns: Points in a row.
        rows: Rows of points.
        points: What they are.

    Raises:
        InputError: There are more.
    """
    if columns * rows > _MOST_POINTS:
        found = f"found {columns} x {rows} = {columns * rows}"
        raise refuse(f"expected at most {_MOST_POINTS} {points}, {found}")


def read(board: type[BoardT], parameters: Mapping[str, Any]) -> BoardT:
    """Return the board with these parameters.

    Raises:
        InputError: A key is unknown, missing, of a wrong type or out of range.
    """
    known = keys_of(board)
    for name in parameters:
        if name not in known:
            near = did_you_mean(str(name), list(known))
            listed = ", ".join(known)
            raise refuse(
                f"expected the keys {listed} of {_a(board.TYPE)}, found {name!r}",
                f"did you mean {near!r}?" if near else None,
            )
    missing = [key.name for key in known.values() if key.required and key.name not in parameters]
    if missing:
        raise refuse(
            f"{_a(board.TYPE)} needs the keys {', '.join(missing)}", f"such as {board.EXAMPLE}"
        )
    return board(**{name: _checked(known[name], value) for name, value in parameters.items()})


def _checked(key: Key, value: Any) -> Any:
    accepted = isinstance(value, _ACCEPTED[key.kind])
    if not accepted or (isinstance(value, bool) and key.kind is not bool):
        raise refuse(f"expected {_EXPECTED[key.kind]} as {key.name}, found {value!r}")
    least, most = key.limits.least, key.limits.most
    if key.kind is int and not least <= value <= most:
        raise refuse(f"expected a whole number from {least} to {most} as {key.name}, found {value}")
    shortest, longest = _LENGTHS_MM
    if key.kind is float and not shortest <= value <= longest:
        expected = f"expected a length above 0 mm as {key.name}"
        if value > 0:
            expected = f"expected a length from {shortest:g} to {longest:g} mm as {key.name}"
        raise refuse(f"{expected}, found {value}")
    return value


def _a(noun: str) -> str:
    return f"an {noun}" if noun[0] in "aeiou" else f"a {noun}"
