"""The records of an MCAP file: a kind, a length and a content, which is skipped until it is needed.

A record stands in the file or in the unpacked content of a chunk; both are bytes with offsets. No
length in a file is believed before it has been compared with what is there.
"""

from __future__ import annotations

import stat
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import IO, Any, NamedTuple, Protocol

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError

from handeye_cli.errors import InputError

MAGIC = b"\x89MCAP0\r\n"
MAX_BYTES = 2**28
"""More is never held in memory at once: a record that long, packed or unpacked, is damage."""
RECORD_HEAD = struct.Struct("<BQ")

_BUFFER_BYTES = 2**14
"""Read ahead. Small messages stand together; behind a picture, what was read ahead is wasted."""
_FOREIGN = {
    b"#ROSBAG": "this is a ROS 1 bag: convert it with `mcap convert`",
    b"SQLite ": "this is a ROS 2 bag in SQLite: convert it with `ros2 bag convert` to mcap",
    b"\x28\xb5\x2f\xfd": "this file is compressed as a whole: unpack it with `zstd -d`",
}
_FAULTS = (
    McapError,
    zstandard.ZstdError,
    struct.error,
    ValueError,
    LookupError,
    ArithmeticError,
    MemoryError,
    NotImplementedError,
    OSError,
    RuntimeError,
)
"""Everything the mcap packages and their codecs raise on damaged bytes."""


class DamageError(Exception):
    """Bytes that are not what they should be; it says what was found and never leaves the reader.

    Attributes:
        offset: Where the broken record starts in its source, when that is known.
    """

    def __init__(self, found: str, offset: int = 0) -> None:
        super().__init__(found)
        self.offset = offset


class Source(Protocol):
    """Bytes that are read in parts."""

    def read(self, start: int, stop: int) -> bytes:
        """Return the bytes between two offsets.

        Raises:
            DamageError: They end before that.
        """

    def unpack(self, form: struct.Struct, start: int) -> tuple[Any, ...]:
        """Return what is packed in some form at an offset.

        Raises:
            DamageError: The bytes end before it does.
        """


class Held:
    """The content of a chunk in memory.

    Args:
        data: The content.
        start: Offset of its first byte.
    """

    def __init__(self, data: bytes, start: int = 0) -> None:
        self._data = data
        self._start = start

    def read(self, start: int, stop: int) -> bytes:
        """Return the bytes between two offsets; see `Source`."""
        start, stop = start - self._start, stop - self._start
        if stop > len(self._data):
            raise self._too_short(stop)
        return self._data[start:stop]

    def unpack(self, form: struct.Struct, start: int) -> tuple[Any, ...]:
        """Return what is packed at an offset; see `Source`."""
        start -= self._start
        if start + form.size > len(self._data):
            raise self._too_short(start + form.size)
        return form.unpack_from(self._data, start)

    def _too_short(self, needed: int) -> DamageError:
        return DamageError(f"{len(self._data)} bytes where at least {needed} are expected")


class FileBytes:
    """An open MCAP file.

    Attributes:
        path: Its name.
        size: Its length in bytes.
    """

    def __init__(self, path: str, stream: IO[bytes]) -> None:
        self.path = path
        self.size = stream.seek(0, 2)
        self._stream = stream

    def read(self, start: int, stop: int) -> bytes:
        """Return the bytes between two offsets; see `Source`."""
        if stop > self.size or stop - start > MAX_BYTES:
            raise DamageError(f"{stop - start} bytes, {self.size - start} before the end")
        try:
            self._stream.seek(start)
            data = self._stream.read(stop - start)
        except OSError as fault:
            raise DamageError(f"bytes that cannot be read: {fault.strerror}") from fault
        if len(data) < stop - start:
            raise DamageError("a file that became shorter while it was read")
        return data

    def unpack(self, form: struct.Struct, start: int) -> tuple[Any, ...]:
        """Return what is packed at an offset; see `Source`."""
        return form.unpack(self.read(start, start + form.size))

    @property
    def is_cut(self) -> bool:
        """Whether the end of the file is missing."""
        size = len(MAGIC)
        try:
            return self.size < 2 * size or self.read(self.size - size, self.size) != MAGIC
        except DamageError:
            return True


class Record(NamedTuple):
    """Where a record stands in its source.

    Attributes:
        opcode: Its kind.
        offset: Its first byte.
        start: The first byte of its content.
        stop: The byte after the last.
    """

    opcode: int
    offset: int
    start: int
    stop: int


def records(source: Source, start: int, stop: int) -> Iterator[Record]:
    """Yield the records that stand between two offsets, reading nothing but their heads.

    Raises:
        DamageError: A record has no kind or does not end before `stop`.
    """
    while start < stop:
        content = start + RECORD_HEAD.size
        if content > stop:
            raise DamageError(f"{stop - start} bytes at the end, too few for a record", start)
        try:
            opcode, length = source.unpack(RECORD_HEAD, start)
        except DamageError as fault:
            raise DamageError(str(fault), start) from fault
        if opcode == 0 or length > stop - content:
            found = f"a record with opcode {opcode} and {length} bytes"
            raise DamageError(f"{found}, {stop - content} bytes before the end", start)
        yield Record(opcode, start, content, content + length)
        start = content + length


@contextmanager
def opened(path: str) -> Iterator[FileBytes]:
    """Open an MCAP file.

    Raises:
        InputError: It cannot be opened, or does not start as an MCAP file does.
    """
    try:
        _refuse_stream(path)
        stream = Path(path).open("rb", buffering=_BUFFER_BYTES)  # noqa: SIM115  closed below
    except OSError as fault:
        raise InputError(f"cannot read it: {fault.strerror}", where=path) from fault
    with stream:
        start = stream.read(len(MAGIC))
        if start != MAGIC:
            raise _not_mcap(path, start)
        yield FileBytes(path, stream)


def require_mcap(path: str) -> None:
    """Check that a file can be opened and begins as an MCAP file does.

    Raises:
        InputError: It cannot or does not.
    """
    with opened(path):
        pass


@contextmanager
def faults_as_damage(what: str) -> Iterator[None]:
    """Turn whatever the mcap packages raise on damaged bytes into a DamageError.

    Args:
        what: What the bytes should be, for people.
    """
    try:
        yield
    except _FAULTS as fault:
        reason = str(fault) or type(fault).__name__
        raise DamageError(f"{what} that cannot be read: {reason}") from fault


def damaged(found: str, where: str) -> InputError:
    """Return the error for a file that cannot be used as it is."""
    return InputError(
        f"expected intact MCAP data, found damage: {found}",
        where=where,
        hint="`mcap recover` may save the rest",
    )


def stream_of(content: bytes) -> ReadDataStream:
    """Return bytes as the mcap package reads them."""
    return ReadDataStream(BytesIO(content))


def _refuse_stream(path: str) -> None:
    mode = Path(path).stat().st_mode
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise InputError(
            "expected a file, found a device or pipe",
            where=path,
            hint="an MCAP recording is read in more than one go: copy it into a file",
        )


def _not_mcap(path: str, start: bytes) -> InputError:
    found = f"a file that starts with {start!r}" if start else "an empty file"
    hints = [hint for magic, hint in _FOREIGN.items() if start.startswith(magic)]
    return InputError(
        f"expected an MCAP recording, found {found}", where=path, hint=hints[0] if hints else None
    )
