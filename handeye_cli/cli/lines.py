"""Command lines that people are told to run, to be copied whatever their files are called."""

from __future__ import annotations

import shlex
from collections.abc import Iterable


def command_line(command: str, name: str, flags: Iterable[str] = ()) -> str:
    """Return the line that runs a command on a file.

    Args:
        command: Such as `solve`.
        name: The file as a person named it; one that starts like a flag is named by its folder.
        flags: What follows.
    """
    file = f"./{name}" if name.startswith("-") else name
    return shlex.join(["handeye", command, file, *flags])
