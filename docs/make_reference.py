"""Writes `reference.md` beside this script from the flags that the commands take.

    python docs/make_reference.py

The page is what `handeye COMMAND --help` says, for reading and searching without a terminal. A test
compares it with what this script would write, so that it cannot fall behind.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from dataclasses import MISSING, Field, fields
from enum import Enum
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, get_args, get_origin

from handeye_cli.cli.app import COMMANDS
from handeye_cli.cli.flags import Argument, Flag
from handeye_cli.cli.grouping import command_of, flags_of, groups_of

PAGE = Path(__file__).with_name("reference.md")

_HEAD = """# Reference of the commands

Every command with all its flags, written by `docs/make_reference.py` from the command line itself.
[commands.md](commands.md) has an example of each, [cookbook.md](cookbook.md) longer ones.

`handeye --version` prints the version. `handeye --install-completion` makes the shell complete
commands and flags; `--show-completion` prints the script instead. `--debug`, anywhere in a line,
shows the traceback of a bug.
"""
_ARGUMENTS = "Arguments"


def page() -> str:
    """Return the page as it should be."""
    index = "\n".join(
        f"- [`handeye {name}`](#handeye-{name.replace(' ', '-')}): {_summary(name)}"
        for name in COMMANDS
    )
    return "\n".join([_HEAD, index, *(_section(name) for name in COMMANDS)])


def _section(name: str) -> str:
    module = import_module(COMMANDS[name])
    command = command_of(module, name)
    _, _, text = inspect.cleandoc(command.__doc__ or "").partition("\n\n")
    parts = [f"\n## handeye {name}", _summary(name), *([text] if text else []), _examples(module)]
    tables: dict[str, list[str]] = {}
    for group in groups_of(command).values():
        for panel, row in _rows(group):
            tables.setdefault(panel, []).append(row)
    return "\n\n".join([*parts, *(_table(panel, rows) for panel, rows in tables.items())]) + "\n"


def _summary(name: str) -> str:
    command = command_of(import_module(COMMANDS[name]), name)
    return inspect.cleandoc(command.__doc__ or "").split("\n\n")[0].replace("\n", " ")


def _examples(module: ModuleType) -> str:
    return "\n".join(["```console", *(f"$ {example}" for example in module.EXAMPLES), "```"])


def _table(panel: str, rows: list[str]) -> str:
    kind = "argument" if panel == _ARGUMENTS else "flag"
    head = [f"### {panel}", "", f"| {kind} | value | default | meaning |", "|---|---|---|---|"]
    return "\n".join([*head, *rows])


def _rows(group: Any) -> Iterator[tuple[str, str]]:
    """Yield the panel and the row of every flag of a group."""
    flags = flags_of(group)
    for field in fields(group):
        kind, flag = flags[field.name]
        is_argument = isinstance(flag, Argument)
        panel = _ARGUMENTS if is_argument else flag.settings.get("rich_help_panel", "Options")
        cells = [
            flag.settings["metavar"] if is_argument else _spellings(field.name, flag),
            "" if is_argument else _value(kind, flag),
            _default(field),
            flag.settings["help"].replace("|", r"\|"),
        ]
        yield panel, f"| {' | '.join(cells)} |"


def _spellings(name: str, flag: Flag) -> str:
    return ", ".join(f"`{each}`" for each in flag.names or (f"--{name.replace('_', '-')}",))


def _value(kind: Any, flag: Flag) -> str:
    """Return what stands behind a flag: its metavar or its choices, and its limits."""
    types = [each for each in get_args(kind) or (kind,) if each is not type(None)]
    plain = types[0]
    if plain is bool:
        return ""
    known = isinstance(plain, type) and issubclass(plain, Enum)
    choices = " or ".join(f"`{each.value}`" for each in plain) if known else ""
    word = flag.settings.get("metavar", "").replace("|", r"\|")
    words = [choices or word, _limits(flag), "repeatable" if get_origin(plain) is list else ""]
    return ", ".join(filter(None, words))


def _limits(flag: Flag) -> str:
    ends = {"at least": flag.settings.get("min"), "at most": flag.settings.get("max")}
    return " and ".join(f"{word} {end:g}" for word, end in ends.items() if end is not None)


def _default(field: Field[Any]) -> str:
    if field.default is MISSING:
        return "required"
    if field.default is None or field.default is False:
        return ""
    return f"`{field.default}`"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
