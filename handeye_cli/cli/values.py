"""What no flag can have as its value, whatever it means."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import Any

from handeye_cli.cli.flags import Flag
from handeye_cli.cli.grouping import flags_of, spellings
from handeye_cli.errors import UsageError

_MOST = 1e12
"""Far beyond any level or limit, and small enough that no product of them overflows."""
_STDIN = ("-", "@-")
_READ = frozenset(
    ("source", "further", "calibration", "camera", "plan", "after", "mount_T_optical")
)
"""Fields that name what is read."""


def check_values(groups: Mapping[str, Any], command: str) -> None:
    """Refuse an empty text, a number that is none, and standard input for two things at once.

    An empty text is what a script passes whose variable is not set. As a path it would be the
    working folder.

    Args:
        groups: The groups of flags that a command takes.
        command: Its name.

    Raises:
        UsageError: A value is one of these.
    """
    streams = []
    for field, name, value in _values(groups):
        if value == "":
            raise UsageError(
                f"expected a value for {name}, found an empty text",
                where=f"handeye {command}",
                hint="a variable of the shell may not be set",
            )
        if isinstance(value, float) and not abs(value) <= _MOST:
            raise UsageError(
                f"expected {name} to be a number of at most {_MOST:g}, found {value:g}",
                where=f"handeye {command}",
            )
        if field in _READ and value in _STDIN:
            streams.append(name)
    if len(streams) > 1:
        raise UsageError(
            f"expected standard input once, found it as {' and as '.join(streams)}",
            where=f"handeye {command}",
            hint="what is read from it is gone: put one of the two into a file",
        )


def _values(groups: Mapping[str, Any]) -> Iterator[tuple[str, str, Any]]:
    """Yield field, spelling and value of all that was given; those of a list one by one."""
    for group in groups.values():
        flags = flags_of(type(group))
        for field in fields(group):
            value = getattr(group, field.name)
            if value is None or value is field.default:
                continue
            name = _spelling(field.name, flags[field.name][1])
            for each in value if isinstance(value, list) else [value]:
                yield field.name, name, each


def _spelling(field: str, flag: Flag) -> str:
    names = spellings(field, flag)
    return names[0] if names else str(flag.settings.get("metavar", field.upper()))
