"""Folders that a command puts its files into."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
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


@contextmanager
def undone_on_failure(folder: str, files: Sequence[str]) -> Iterator[None]:
    """Take away again what was put into a folder, and the folder, if the work on it is not ended.

    A file that was there before stays as it is by then, and so does its folder.

    Args:
        folder: A folder that may be missing yet.
        files: All that may be put into it, at any depth.
    """
    missing = [Path(file) for file in files if not os.path.lexists(file)]
    above = dict.fromkeys(parent for file in missing for parent in (file.parent, Path(folder)))
    # the deepest first, as a folder goes only when it is empty
    made = sorted(
        (each for each in above if not os.path.lexists(each)), key=lambda each: -len(each.parts)
    )
    try:
        yield
    except BaseException:
        for remove in (*(file.unlink for file in missing), *(parent.rmdir for parent in made)):
            with suppress(OSError, ValueError):
                remove()
        raise
