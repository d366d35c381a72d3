"""The help, written from the flags themselves: Typer with its helpers takes longer to load.

Typer shows these texts too, so that every way to ask for help gives the same.
"""

from __future__ import annotations

import inspect
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, Field, fields
from enum import Enum
from textwrap import wrap
from typing import Any, get_origin

from handeye_cli.cli.commands import SUMMARIES
from handeye_cli.cli.flags import DEBUG, Argument, Flag
from handeye_cli.cli.grouping import command_of, flags_of, groups_of, single_type, spellings

_PURPOSE = "Find where a camera sits on a robot, from a recording, and say how sure that is."
_EPILOG = (
    "The line is recording -> extract -> extrinsics -> solve -> verify; every command takes "
    "the recording or any document on the way and runs what is missing. Exit codes: 0 done, 1 a "
    "bug, 2 wrong usage, 3 bad input, 4 the data do not determine the answer, 5 not converged, "
    "6 a quality limit was missed."
)
_HELP = ("--help, -h", "Show this message and exit.")
_GENERAL = (
    ("--version", "Print the version."),
    (DEBUG, "Show the traceback of a bug; it may stand anywhere."),
    ("--install-completion", "Make this shell complete commands and flags."),
    ("--show-completion", "Print the script that does so."),
    _HELP,
)
_NARROWEST, _USUAL, _WIDEST = 72, 80, 100
_LEFT = 28
"""Columns that flags may take before their text starts on a line of its own."""
_HEADING, _FLAG = "1", "1;36"
"""Codes of a terminal: bold, and bold cyan."""

_UNBROKEN = "\N{NO-BREAK SPACE}"

_Row = tuple[str, str]


def of_all() -> str:
    """Return the help of `handeye`: its commands and the flags of them all."""
    parts = [
        f"{_styled('Usage:', _HEADING)} handeye [OPTIONS] COMMAND [ARGS]...",
        _paragraph(_PURPOSE),
        _panels({"Commands": list(SUMMARIES.items()), "Options": list(_GENERAL)}),
        _paragraph(_EPILOG),
    ]
    return "\n\n".join(parts) + "\n"


def of_command(name: str, module: Any) -> str:
    """Return the help of one command.

    Args:
        name: Its words.
        module: Where it is: a function of that name, which takes groups of flags, and EXAMPLES.
    """
    command = command_of(module, name)
    panels: dict[str, list[_Row]] = {}
    for panel, row in _rows(command):
        panels.setdefault(panel, []).append(row)
    panels.setdefault("Options", []).append(_HELP)
    places = " ".join(["[OPTIONS]", *(left for left, _ in panels.get("Arguments", ()))])
    parts = [
        f"{_styled('Usage:', _HEADING)} handeye {name} {places}",
        *map(_paragraph, inspect.cleandoc(command.__doc__ or "").split("\n\n")),
        "\n".join([_styled("Examples:", _HEADING), *map(_example, module.EXAMPLES)]),
        _panels(panels),
    ]
    return "\n\n".join(parts) + "\n"


def _rows(command: Callable[..., None]) -> Iterator[tuple[str, _Row]]:
    """Yield the panel of every flag of a command, and what is to be said there."""
    for group in groups_of(command).values():
        flags = flags_of(group)
        for field in fields(group):
            kind, flag = flags[field.name]
            plain = single_type(kind)
            text = " ".join(filter(None, [flag.settings.get("help", ""), _facts(field, flag)]))
            if isinstance(flag, Argument):
                yield "Arguments", (_place(plain, field, flag), text)
            else:
                panel = flag.settings.get("rich_help_panel", "Options")
                yield panel, (_spelled(plain, field, flag), text)


def _place(plain: Any, field: Field[Any], flag: Flag) -> str:
    """Return how an argument is written in a line."""
    word = flag.settings.get("metavar", field.name.upper())
    known = word if field.default is MISSING else f"[{word}]"
    return f"{known}..." if get_origin(plain) is list else known


def _spelled(plain: Any, field: Field[Any], flag: Flag) -> str:
    """Return how a flag is written in a line, with its value."""
    names = ", ".join(spellings(field.name, flag))
    if plain is bool:
        return names
    is_choice = isinstance(plain, type) and issubclass(plain, Enum)
    usual = "|".join(each.value for each in plain) if is_choice else "TEXT"
    return f"{names} {flag.settings.get('metavar', usual)}"


def _facts(field: Field[Any], flag: Flag) -> str:
    """Return limits and default of a flag's value, in brackets."""
    limits = {"at least": flag.settings.get("min"), "at most": flag.settings.get("max")}
    facts = [f"{word} {limit:.10g}" for word, limit in limits.items() if limit is not None]
    if field.default is MISSING:
        facts.append("required")
    elif field.default is not None and field.default is not False:
        facts.append(f"default: {field.default}")
    return f"[{', '.join(facts)}]" if facts else ""


def _paragraph(text: str) -> str:
    return _wrapped(" ".join(text.split()), _width(), "  ")


def _example(text: str) -> str:
    """Return an example that can be copied however narrow the terminal is."""
    words = " ".join(text.replace("\\\n", " ").split())
    # A flag and its value stay on one line: wrap() does not break at such a space.
    whole = re.sub(r"( -\S+) (?=[^-])", f"\\1{_UNBROKEN}", f"$ {words}")
    # Six columns are for the indentation, two for the sign that the line goes on.
    lines = wrap(whole, _width() - 8, break_long_words=False, break_on_hyphens=False)
    return "  " + " \\\n      ".join(lines).replace(_UNBROKEN, " ")


def _panels(panels: Mapping[str, list[_Row]]) -> str:
    """Return tables of two columns, the second of which starts at the same place in all."""
    lengths = [len(left) for rows in panels.values() for left, _ in rows]
    column = 4 + max(length for length in lengths if length <= _LEFT)
    return "\n\n".join(
        "\n".join([_styled(f"{title}:", _HEADING), *(_lines(row, column) for row in rows)])
        for title, rows in panels.items()
    )


def _lines(row: _Row, column: int) -> str:
    left, text = row
    right = _wrapped(text, _width(), " " * column)
    flag = _styled(left, _FLAG)
    if len(left) > column - 4:
        return f"  {flag}\n{right}"
    return f"  {flag}{' ' * (column - 2 - len(left))}{right.lstrip()}"


def _wrapped(text: str, width: int, indent: str) -> str:
    lines = wrap(
        text, width, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False
    )
    return "\n".join(lines)


def _width() -> int:
    """Return the columns of the terminal, within what is good to read."""
    columns = os.environ.get("COLUMNS", "")
    if columns.isdecimal():
        width = int(columns)
    else:
        width = os.get_terminal_size().columns if _on_terminal() else _USUAL
    return min(max(width, _NARROWEST), _WIDEST)


def _on_terminal() -> bool:
    # What only looks like a terminal, as in a test, has no size.
    return sys.stdout.isatty() and sys.stdout is sys.__stdout__


def _styled(text: str, code: str) -> str:
    plain = "NO_COLOR" in os.environ or os.environ.get("TERM") == "dumb" or os.name == "nt"
    return text if plain or not _on_terminal() else f"\033[{code}m{text}\033[0m"
