"""Folders that a command puts its files into."""

from __future__ import annotations

from pathlib import Path

from handeye_cli.errors import InputError, UsageError


def make_folder(path: str, flag: str) -> None:
    """Make a folder, and those above it, unless it is there.

    Args:
        path: The folder.
        flag: The flag that names it.

    Raises:
        UsageError: It is there and is no folder.
        InputError: It cannot be made.
    """
    try:
        if Path(path).exists() and not Path(path).is_dir():
            raise UsageError("expected a folder, found a file", where=f"{flag} {path}")
        Path(path).mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        message = f"the folder cannot be made: {reason}"
        raise InputError(message, where=f"{flag} {path}") from error
