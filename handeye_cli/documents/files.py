"""Bytes in and out: bounded reading, and writing that leaves all of a file or nothing."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from handeye_cli.documents.text import MAX_BYTES
from handeye_cli.errors import InputError, UsageError

STDIN = "-"
"""The source that stands for standard input."""
_SEPARATORS = tuple(filter(None, (os.sep, os.altsep)))
"""At the end of a path they say that it is a folder."""


def label_of(source: str) -> str:
    """Return what error messages call a source."""
    return "standard input" if source == STDIN else source


def read_bytes(source: str, stdin: BinaryIO | None = None) -> bytes:
    """Return the bytes of a file or of standard input.

    At most one byte more than a document may have is read, so that an endless stream ends.

    Args:
        source: A path, or `-` for standard input.
        stdin: The stream to read for `-`; the process's own when None.

    Raises:
        InputError: It cannot be read.
    """
    try:
        if source == STDIN:
            return (stdin or sys.stdin.buffer).read(MAX_BYTES + 1)
        with Path(source).open("rb") as file:
            return file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = _reason(error)
        hint = "check the path" if isinstance(error, FileNotFoundError) else None
        message = f"expected a readable file: {reason}"
        raise InputError(message, where=label_of(source), hint=hint) from error


def write_text(text: str, path: str, force: bool = False) -> None:
    """Write a text file in UTF-8, wholly or not at all; see `write_bytes`."""
    write_bytes(text.encode("utf-8"), path, force)


def write_bytes(data: bytes, path: str, force: bool = False) -> None:
    """Write a file wholly or not at all; see `streamed_file`."""
    with streamed_file(path, force) as file:
        file.write(data)


@contextmanager
def streamed_file(path: str, force: bool = False) -> Iterator[BinaryIO]:
    """Open a file for writing that is there wholly or not at all.

    The bytes go to a temporary file in the same folder, reach the disk, and then get the name.

    Args:
        path: The file to write; where it is a link, the file it points to.
        force: Whether a file that is there may be replaced.

    Yields:
        The temporary file. It is removed again when the writing fails.

    Raises:
        UsageError: The file exists and may not be replaced, or is a folder or device.
        InputError: It cannot be written.
    """
    try:
        final = Path(os.path.realpath(path))
        _require_replaceable(final, path, force)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be written: {_reason(error)}", where=path) from error
    temporary = final.with_name(f".{final.name}.{os.urandom(4).hex()}.tmp")
    try:
        with temporary.open("xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        _publish(temporary, final, path, force)
    except OSError as error:
        raise InputError(f"cannot be written: {_reason(error)}", where=path) from error
    finally:
        temporary.unlink(missing_ok=True)


def check_destination(path: str, force: bool = False) -> None:
    """Refuse a file that could not be written, before any work is done for it.

    Args:
        path: The file that is to be written.
        force: Whether a file that is there may be replaced.

    Raises:
        UsageError: The file exists and may not be replaced, or is a folder or device.
        InputError: Its folder does not exist, or it can have no such name.
    """
    if path == STDIN:
        message = "expected the name of a file, found '-', which stands for a stream"
        raise UsageError(message, hint="./- is a file of that name")
    try:
        folder = Path(path).parent
        if not folder.is_dir():
            raise InputError("expected an existing folder to write into", where=str(folder))
        _require_replaceable(Path(os.path.realpath(path)), path, force)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be written: {_reason(error)}", where=path) from error


def _require_replaceable(final: Path, path: str, force: bool) -> None:
    if path.endswith(_SEPARATORS):
        raise UsageError("expected the name of a file, found that of a folder", where=path)
    if final.is_symlink():
        raise InputError("cannot be written: it is a link that leads to itself", where=path)
    if not final.exists():
        return
    if not final.is_file():
        kind = "folder" if final.is_dir() else "device or pipe"
        message = f"expected the name of a file, found a {kind}"
        raise UsageError(message, where=path, hint="give a file's name, or - for stdout")
    if not force:
        raise _exists(path)


def _exists(path: str) -> UsageError:
    return UsageError("the file exists already", where=path, hint="replace it with --force")


def _publish(temporary: Path, final: Path, path: str, force: bool) -> None:
    """Give the temporary file its name; without `force` never one that is taken by now."""
    if not force:
        try:
            final.hardlink_to(temporary)
        except FileExistsError:
            raise _exists(path) from None
        except OSError:
            # a file system without hard links, where the check made before has to do
            temporary.replace(final)
        return
    with suppress(OSError):
        temporary.chmod(final.stat().st_mode & 0o7777)
    temporary.replace(final)


def _reason(error: Exception) -> str:
    return error.strerror or str(error) if isinstance(error, OSError) else str(error)
