"""Plain command lines, read without Typer: it takes longer to load than poses take to solve.

A line is plain when all its words are known and complete and its values are single texts.
Everything else - help, numbers, several inputs, faults, rare spellings - is left to Typer, which
reads the same flags and means the same by them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import MISSING, fields
from enum import Enum
from typing import Any

from handeye_cli.cli.flags import Argument, Flag
from handeye_cli.cli.grouping import flags_of, groups_of, single_type, spellings


class _NotPlainError(Exception):
    """The line is one for Typer."""


def plain_groups(command: Callable[..., None], words: Sequence[str]) -> dict[str, Any] | None:
    """Return the groups a command takes, by name, or None when Typer has to read the line.

    Args:
        command: A function of groups of flags.
        words: The words behind the command's name.
    """
    groups = groups_of(command)
    flags = {name: each for group in groups.values() for name, each in flags_of(group).items()}
    values: dict[str, Any] = {}
    try:
        for name, value in _read(flags, iter(words)):
            if name in values:
                return None
            values[name] = value
        return {name: _filled(group, values) for name, group in groups.items()}
    except _NotPlainError:
        return None


def _read(flags: dict[str, tuple[Any, Flag]], words: Iterator[str]) -> Iterator[tuple[str, Any]]:
    """Yield the name and the value of every field that the words fill."""
    known = {spelling: name for name in flags for spelling in spellings(name, flags[name][1])}
    places = iter([name for name in flags if isinstance(flags[name][1], Argument)])
    for word in words:
        if not _is_flag(word):
            name = _next(places)
            yield name, _converted(flags[name][0], word, attached=True)
            continue
        spelling, equals, text = word.partition("=")
        name = _known(known, spelling)
        kind, _ = flags[name]
        if kind is bool:
            yield name, _switched_on(equals)
        else:
            yield name, _converted(kind, text if equals else next(words, "--"), bool(equals))


def _is_flag(word: str) -> bool:
    return word.startswith("-") and word != "-"


def _next(places: Iterator[str]) -> str:
    for name in places:
        return name
    raise _NotPlainError


def _known(spellings: dict[str, str], spelling: str) -> str:
    if spelling not in spellings:
        raise _NotPlainError
    return spellings[spelling]


def _switched_on(equals: str) -> bool:
    if equals:
        raise _NotPlainError
    return True


def _converted(kind: Any, text: str, attached: bool) -> Any:
    """Return the value of a flag's text; `attached` is that of `--flag=text`."""
    plain = single_type(kind)
    if attached or not _is_flag(text):
        if plain is str:
            return text
        is_enum = isinstance(plain, type) and issubclass(plain, Enum)
        if is_enum and text in {each.value for each in plain}:
            return plain(text)
    raise _NotPlainError


def _filled(group: type, values: dict[str, Any]) -> Any:
    own = {field.name: field.default for field in fields(group)}
    own |= {name: value for name, value in values.items() if name in own}
    if MISSING in own.values():
        raise _NotPlainError
    return group(**own)
