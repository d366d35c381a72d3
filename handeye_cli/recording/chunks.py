"""The content of a chunk, its sizes and its checksum compared before any of it is used."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import zstandard
from mcap.opcode import Opcode

from handeye_cli.recording.framing import (
    MAX_BYTES,
    DamageError,
    FileBytes,
    Held,
    Record,
    Source,
    faults_as_damage,
    records,
)

_ENTRIES = (Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL)
_HEAD = struct.Struct("<QQQII")
"""First and last time, size and checksum of the unpacked content, length of the next text."""
_LENGTH = struct.Struct("<Q")
_LONGEST_NAME = 32
_BLOCK = 2**20
_MOST_HELD = 2**24
"""A longer chunk that is not packed is checked in blocks, and its messages are read once more."""


@dataclass(frozen=True)
class Content:
    """The records inside a chunk, or of a file without chunks.

    Attributes:
        path: The file.
        source: Where they stand, by the file's offsets unless the chunk is packed.
        start: The first byte of the first one.
        stop: The byte after the last.
        packed: Offset of the chunk's record when the source is its unpacked content, else None.
    """

    path: str
    source: Source
    start: int
    stop: int
    packed: int | None

    def entries(self) -> Iterator[Record]:
        """Yield the messages, schemas and channels, which is all that a chunk may hold.

        Raises:
            DamageError: There is something else, so what follows is not what it seems.
        """
        for record in records(self.source, self.start, self.stop):
            if record.opcode not in _ENTRIES:
                found = f"a record with opcode {record.opcode} in a chunk"
                raise DamageError(found, record.offset)
            yield record


@dataclass(frozen=True)
class _Head:
    size: int
    checksum: int
    compression: str
    start: int
    stop: int


def content_of(file: FileBytes, chunk: Record) -> Content:
    """Return the content of a chunk; in memory where it has to be read as a whole anyway.

    Raises:
        DamageError: Its sizes do not fit together or are too large, it cannot be unpacked, or its
            checksum is another one.
    """
    head = _head(file, chunk)
    if head.compression:
        data = _unpacked(file.read(head.start, head.stop), head)
        _compare(zlib.crc32(data), head)
        return Content(file.path, Held(data), 0, len(data), chunk.offset)
    source: Source = file
    if head.checksum and head.size <= _MOST_HELD:
        data = file.read(head.start, head.stop)
        _compare(zlib.crc32(data), head)
        source = Held(data, head.start)
    elif head.checksum:
        _compare(_file_checksum(file, head), head)
    return Content(file.path, source, head.start, head.stop, None)


def _head(file: FileBytes, chunk: Record) -> _Head:
    start = chunk.start
    most = _HEAD.size + _LONGEST_NAME + _LENGTH.size
    raw = file.read(start, min(start + most, chunk.stop))
    with faults_as_damage("a chunk"):
        _, _, size, checksum, name = _HEAD.unpack_from(raw)
        compression = raw[_HEAD.size : _HEAD.size + name].decode()
        if compression and compression not in _UNPACKERS:
            raise DamageError(f"a chunk with compression {compression!r}")
        (length,) = _LENGTH.unpack_from(raw, _HEAD.size + name)
    start += _HEAD.size + name + _LENGTH.size
    if length > chunk.stop - start:
        found = f"a chunk with {length} bytes of data"
        raise DamageError(f"{found}, {chunk.stop - start} before its end")
    if size > MAX_BYTES and compression:
        raise DamageError(f"a chunk of {size} bytes, of which at most {MAX_BYTES} are unpacked")
    if not compression and size != length:
        raise DamageError(f"a chunk of {size} bytes that holds {length}")
    return _Head(size, checksum, compression, start, start + length)


def _unpacked(data: bytes, head: _Head) -> bytes:
    if not data and not head.size:
        return b""
    with faults_as_damage("a chunk"):
        content = _UNPACKERS[head.compression](data, head.size)
    if len(content) != head.size:
        raise _wrong_size(len(content), head.size)
    return content


def _zstd(data: bytes, size: int) -> bytes:
    """Return the content of a frame, which is never larger than it was said to be."""
    said = zstandard.frame_content_size(data)
    if said not in (-1, size):
        raise _wrong_size(said, size)
    return zstandard.ZstdDecompressor().decompress(data, max_output_size=size)


def _lz4(data: bytes, size: int) -> bytes:
    """Return the content of a frame, which is at most one byte larger than it was said to be."""
    import lz4.frame  # type: ignore[import-untyped]

    return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1))


_UNPACKERS: dict[str, Callable[[bytes, int], bytes]] = {"zstd": _zstd, "lz4": _lz4}


def _wrong_size(found: int, size: int) -> DamageError:
    return DamageError(f"a chunk that unpacks to {found} bytes, expected {size}")


def _file_checksum(file: FileBytes, head: _Head) -> int:
    checksum = 0
    for start in range(head.start, head.stop, _BLOCK):
        checksum = zlib.crc32(file.read(start, min(start + _BLOCK, head.stop)), checksum)
    return checksum


def _compare(checksum: int, head: _Head) -> None:
    if head.checksum and checksum != head.checksum:
        raise DamageError(f"a chunk with checksum {checksum}, expected {head.checksum}")
