"""Commands take groups of flags.

A command takes a few frozen dataclasses, `def solve(source: Source, output: Output)`, whose fields
are annotated with a `Flag` or an `Argument`. So a flag is written down once however many commands
share it, and inside a command its group travels as one value.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import cache
from keyword import iskeyword
from types import NoneType
from typing import Any, get_args, get_type_hints

from handeye_cli.cli.flags import Argument, Flag

_INPUTS = ("source", "further")
"""Fields that name what is read."""


def command_of(module: Any, name: str) -> Callable[..., None]:
    """Return the function of a command's module; it has the name that PEP 8 makes of the words."""
    word = name.replace(" ", "_")
    command: Callable[..., None] = getattr(module, f"{word}_" if iskeyword(word) else word)
    return command


def groups_of(command: Callable[..., None]) -> dict[str, Any]:
    """Return the dataclasses that a command takes, by the names of its parameters."""
    return {name: hint for name, hint in get_type_hints(command).items() if name != "return"}


def flags_of(group: type) -> dict[str, tuple[Any, Flag]]:
    """Return the type and the flag of every field of a group."""
    return _flags_of(group)


@cache
def _flags_of(group: type) -> dict[str, tuple[Any, Flag]]:
    hints = get_type_hints(group, include_extras=True)
    return {field.name: get_args(hints[field.name]) for field in fields(group)}


def spellings(field: str, flag: Flag) -> tuple[str, ...]:
    """Return the ways to write a flag in a line; none for an argument."""
    if isinstance(flag, Argument):
        return ()
    return flag.names or (f"--{field.replace('_', '-')}",)


def single_type(kind: Any) -> Any:
    """Return the type of a field that may also be None."""
    return next(each for each in get_args(kind) or (kind,) if each is not NoneType)


def given(*groups: Any) -> dict[str, Any]:
    """Return the flags of these groups that are not at their defaults, in JSON's types.

    The inputs' names are no flags; provenance has a place of its own for them.
    """
    return {
        field.name.replace("_", "-"): _plain(getattr(group, field.name))
        for group in groups
        for field in fields(group)
        if field.name not in _INPUTS and getattr(group, field.name) != field.default
    }


def _plain(value: Any) -> Any:
    return value if isinstance(value, bool | int | float) else str(value)
