"""Folders that a command puts its files into."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from handeye_cli.errors import InputError, UsageError

_STDOUT = "-"


def make_folder(path: str, flag: str) -> None:
    """Make a folder, and those above it, unless it is there.

    Args:
        path: The folder.
        flag: The flag that names it.

    Raises:
        UsageError: It is there and is no folder.
        InputError: It cannot be made.
    """
    if path == _STDOUT:
        message = "expected a folder, found '-', which stands for a stream"
        raise UsageError(message, where=flag, hint="./- is a folder of that name")
    try:
        if Path(path).exists() and not Path(path).is_dir():
            raise UsageError("expected a folder, found a file", where=f"{flag} {path}")
        Path(path).mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        message = f"the folder cannot be made: {reason}"
        raise InputError(message, where=f"{flag} {path}") from error


@contextmanager
def prepared(folder: str, files: Sequence[str], flag: str, *, force: bool) -> Iterator[None]:
    """Make a folder, and those below it, before the work that fills it; undo it if that fails.

    Args:
        folder: A folder that may be missing yet.
        files: All that is to be put into it, at any depth.
        flag: The flag that names it.
        force: Whether files that are there may be replaced.

    Raises:
        UsageError: It is no folder, or one of the files exists and is not to be replaced.
        InputError: It cannot be made.
    """
    from handeye_cli import documents

    with undone_on_failure(folder, files):
        for each in dict.fromkeys([folder, *(str(Path(file).parent) for file in files)]):
            make_folder(each, flag)
        for file in files:
            documents.check_destination(file, force)
        yield


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
