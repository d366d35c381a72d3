"""What a flag is, written down without loading Typer, which reads it only when it is needed."""

from __future__ import annotations

from typing import Any

DEBUG = "--debug"
"""Shows the traceback of a bug; it may stand anywhere in a line."""


class Flag:
    """A flag of the command line.

    Args:
        names: Its spellings; `--` with the name of its field when there are none.
        settings: Whatever else `typer.Option` takes: `help`, `metavar`, `min`, ...
    """

    def __init__(self, *names: str, **settings: Any) -> None:
        self.names = names
        self.settings = settings


class Argument(Flag):
    """A word without a flag; its settings are those of `typer.Argument`."""
