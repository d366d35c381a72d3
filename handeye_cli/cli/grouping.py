"""Typer commands out of groups of flags.

A command takes a few frozen dataclasses, `def solve(source: Source, output: Output)`, whose fields
are annotated as Typer wants them. `flat` shows Typer one flag per field, so a flag is written down
once however many commands share it, and inside a command its group travels as one value.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from dataclasses import MISSING, fields
from typing import Any, get_type_hints


def flat(command: Callable[..., None]) -> Callable[..., None]:
    """Return `command` with the fields of its dataclass parameters as keyword parameters.

    Args:
        command: A function whose parameters are all dataclasses with distinct field names.
    """
    hints = get_type_hints(command)
    groups = {name: hint for name, hint in hints.items() if name != "return"}

    @functools.wraps(command)
    def flattened(**values: Any) -> None:
        command(
            **{
                name: group(**{field.name: values[field.name] for field in fields(group)})
                for name, group in groups.items()
            }
        )

    parameters = [parameter for group in groups.values() for parameter in _parameters(group)]
    flattened.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    flattened.__annotations__ = {each.name: each.annotation for each in parameters}
    return flattened


def _parameters(group: type) -> list[inspect.Parameter]:
    hints = get_type_hints(group, include_extras=True)
    return [
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if field.default is MISSING else field.default,
            annotation=hints[field.name],
        )
        for field in fields(group)
    ]


def given(*groups: Any) -> dict[str, Any]:
    """Return the flags of these groups that are not at their defaults, in JSON's types.

    The input's name is no flag; provenance has a place of its own for it.
    """
    return {
        field.name.replace("_", "-"): _plain(getattr(group, field.name))
        for group in groups
        for field in fields(group)
        if field.name != "source" and getattr(group, field.name) != field.default
    }


def _plain(value: Any) -> Any:
    return value if isinstance(value, bool | int | float) else str(value)
