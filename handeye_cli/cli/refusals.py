"""What a line is refused for, said like every other error: expected, found, and the next step.

Click's own sentences leave out the value that was found, and come in a box that no log wants.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from enum import Enum
from itertools import zip_longest
from typing import Any, get_origin

from handeye_cli.cli.flags import Flag
from handeye_cli.cli.grouping import flags_of, groups_of, single_type, spellings
from handeye_cli.errors import UsageError, did_you_mean

_Flags = dict[str, tuple[Any, Flag]]
_Told = tuple[str, str | None] | None
"""Message and hint, or None where Click's own sentence has to do."""

_KINDS: dict[type, str] = {int: "a whole number", float: "a number"}


def usage_error(
    refused: Any, name: str, command: Callable[..., None] | None, words: Sequence[str]
) -> UsageError:
    """Return the error for what Click refused.

    Args:
        refused: Click's exception.
        name: The command's name; empty for `handeye` itself.
        command: Its function of groups of flags; None for `handeye` itself.
        words: The words behind its name.
    """
    groups = groups_of(command).values() if command else ()
    flags = {field: each for group in groups for field, each in flags_of(group).items()}
    line = f"handeye {name}".rstrip()
    # by name: where these classes live depends on the version of Typer
    sentence = _SENTENCES.get(type(refused).__name__)
    told = sentence(refused, flags, words) if sentence else None
    message, hint = told or (_clicks(refused), None)
    return UsageError(message, where=line, hint=hint or f"{line} --help shows what there is")


def refuse_repeated(command: Callable[..., None], words: Sequence[str]) -> None:
    """Refuse a flag that is given twice and means two things; Click would take the last.

    Args:
        command: A function of groups of flags.
        words: The words behind its name.

    Raises:
        UsageError: There is such a flag.
    """
    for group in groups_of(command).values():
        for field, (kind, flag) in flags_of(group).items():
            if get_origin(single_type(kind)) is list:
                continue
            names = spellings(field, flag)
            found = list(dict.fromkeys(_values(names, words)))
            if len(found) > 1 and single_type(kind) is not bool:
                raise UsageError(
                    f"expected {names[0]} once, found it with {' and with '.join(map(repr, found))}"
                )


def _bad_value(refused: Any, flags: _Flags, words: Sequence[str]) -> _Told:
    field = getattr(refused.param, "name", None)
    if field not in flags:
        return None
    kind, flag = flags[field]
    names = spellings(field, flag)
    found = list(_values(names, words))
    if not found:
        return None
    return f"expected {names[0]} to be {_expected(kind, flag)}, found {found[-1]!r}", None


def _missing(refused: Any, flags: _Flags, _: Sequence[str]) -> _Told:
    field = getattr(refused.param, "name", None)
    if field not in flags:
        return None
    flag = flags[field][1]
    metavar = flag.settings.get("metavar", field.upper())
    names = spellings(field, flag)
    return f"expected {f'{names[0]} {metavar}' if names else metavar}, found none", None


def _unknown_flag(refused: Any, flags: _Flags, _: Sequence[str]) -> _Told:
    known = [each for field in flags for each in spellings(field, flags[field][1])]
    near = did_you_mean(refused.option_name, [*known, "--help"])
    message = f"expected one of its flags, found {refused.option_name!r}"
    return message, f"did you mean {near}?" if near else None


def _bad_use(refused: Any, flags: _Flags, words: Sequence[str]) -> _Told:
    flag = refused.option_name
    kinds = {each: kind for name, (kind, own) in flags.items() for each in spellings(name, own)}
    if kinds.get(flag, bool) is not bool:
        return f"expected a value after {flag}, found none", None
    found = list(_values((flag,), words))
    return (f"expected {flag} without a value, found {found[-1]!r}", None) if found else None


_SENTENCES: dict[str, Callable[[Any, _Flags, Sequence[str]], _Told]] = {
    "BadParameter": _bad_value,
    "MissingParameter": _missing,
    "NoSuchOption": _unknown_flag,
    "BadOptionUsage": _bad_use,
}


def _clicks(refused: Any) -> str:
    sentence = " ".join(str(refused.format_message()).split()).rstrip(".")
    return sentence[:1].lower() + sentence[1:]


def _values(names: Sequence[str], words: Sequence[str]) -> Iterator[str]:
    """Yield what stands in a line as the value of a flag."""
    for word, behind in zip_longest(words, words[1:]):
        spelling, equals, text = word.partition("=")
        if spelling in names and equals:
            yield text
        elif word in names and behind is not None:
            yield behind


def _expected(kind: Any, flag: Flag) -> str:
    """Return what a flag's value has to be."""
    plain = single_type(kind)
    if isinstance(plain, type) and issubclass(plain, Enum):
        return " or ".join(each.value for each in plain)
    low, high = flag.settings.get("min"), flag.settings.get("max")
    limits = [
        f"at {word} {limit:.10g}"
        for word, limit in (("least", low), ("most", high))
        if limit is not None
    ]
    return " of ".join(filter(None, [_KINDS.get(plain, "a text"), " and ".join(limits)]))
