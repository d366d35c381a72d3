"""The MCAP container: which messages a file holds, and where; never more than one chunk in memory.

Records are framed here, by their length and against the file's, and parsed by the `mcap` package.
Its own readers are not used: depending on the layout they hold the whole file in memory, give
nothing at all for a file that was cut off, and lose messages silently when a length is damaged.
A file is read in its own order, since that needs no index; times are sorted where they are used.
"""

from __future__ import annotations

import stat
import struct
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import IO, Any

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel as ChannelRecord
from mcap.records import Chunk as ChunkRecord
from mcap.records import Schema as SchemaRecord
from mcap.stream_reader import get_chunk_data_stream

from handeye_cli.errors import InputError

MAGIC = b"\x89MCAP0\r\n"
MAX_RECORD_BYTES = 2**30
"""A longer record, packed or unpacked, is damage and not data."""

_FOREIGN = {
    b"#ROSBAG": "this is a ROS 1 bag: convert it with `mcap convert`",
    b"SQLite ": "this is a ROS 2 bag in SQLite: convert it with `ros2 bag convert` to mcap",
    b"\x28\xb5\x2f\xfd": "this file is compressed as a whole: unpack it with `zstd -d`",
}
_COMPRESSIONS = ("", "zstd", "lz4")
_RECORD_HEAD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_DECLARATIONS = (Opcode.SCHEMA, Opcode.CHANNEL)
_RELEVANT = (*_DECLARATIONS, Opcode.MESSAGE, Opcode.CHUNK)
_LAST = (Opcode.DATA_END, Opcode.FOOTER)
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


@dataclass(frozen=True)
class Channel:
    """A topic and how its messages are written.

    Attributes:
        topic: Name of the topic.
        message_encoding: Of the payloads, such as `cdr`.
        schema_name: Such as `sensor_msgs/msg/Image`; empty without a schema.
        schema_encoding: Such as `ros2msg`.
        schema_data: The schema itself.
    """

    topic: str
    message_encoding: str
    schema_name: str
    schema_encoding: str
    schema_data: bytes


@dataclass(frozen=True)
class Position:
    """Where a message's payload lies.

    Attributes:
        record: Byte in the file at which its record, or its chunk's, starts.
        start: First byte of the payload in the record's content, which is unpacked for a chunk.
        stop: The byte after the last.
    """

    record: int
    start: int
    stop: int


@dataclass(frozen=True)
class RawMessage:
    """A message as it was recorded.

    Attributes:
        channel: Where it belongs.
        log_time_ns: When it was recorded.
        position: Where it lies in the file.
        data: Its payload.
    """

    channel: Channel
    log_time_ns: int
    position: Position
    data: bytes


@contextmanager
def faults_as_input_error(where: str) -> Iterator[None]:
    """Turn whatever the mcap packages raise on damaged bytes into an InputError.

    Args:
        where: The place in the file, for people.
    """
    try:
        yield
    except _FAULTS as fault:
        raise _damaged(str(fault) or type(fault).__name__, where) from fault


def is_cut(path: str) -> bool:
    """Return whether the end of an MCAP file is missing.

    Raises:
        InputError: The file cannot be opened or is no MCAP file.
    """
    with _opened(path) as (file, size):
        file.seek(max(0, size - len(MAGIC)))
        return size < 2 * len(MAGIC) or file.read() != MAGIC


def scan(path: str, wanted: Callable[[Channel], bool]) -> Iterator[RawMessage]:
    """Yield the messages of the wanted channels in the order of the file.

    A file that was cut off gives everything before the record that is incomplete.

    Args:
        path: The MCAP file.
        wanted: Asked once for every channel.

    Raises:
        InputError: The file cannot be opened, is no MCAP file or is damaged.
    """
    channels = _Channels(wanted)
    cut = is_cut(path)
    with _opened(path) as (file, size):
        for offset, opcode, body in _records(file, size, cut=cut, path=path):
            where = f"{path}, byte {offset}"
            for kind, content, start, stop in _entries(opcode, body, where):
                if kind == Opcode.MESSAGE:
                    position = Position(offset, start + _MESSAGE_HEAD.size, stop)
                    message = channels.message(content, position, where)
                    if message is not None:
                        yield message
                elif kind in _DECLARATIONS:
                    channels.declare(kind, content[start:stop], where)


def read_payloads(path: str, positions: Iterable[Position]) -> Iterator[bytes]:
    """Yield the payloads at some positions, reading nothing else of the file.

    Raises:
        InputError: The file cannot be opened or is not the one the positions were found in.
    """
    with _opened(path) as (file, size):
        for position in positions:
            where = f"{path}, byte {position.record}"
            opcode, length = _head_at(file, position.record)
            fault = _head_fault(opcode, length, size - position.record)
            if fault:
                raise _damaged(fault, where)
            body = file.read(length)
            content = _unpacked(body, where) if opcode == Opcode.CHUNK else body
            if position.stop > len(content):
                raise _damaged(f"a record of {len(content)} bytes", where)
            yield content[position.start : position.stop]


class _Channels:
    """The schemas and channels met so far."""

    def __init__(self, wanted: Callable[[Channel], bool]) -> None:
        self._wanted = wanted
        self._schemas: dict[int, SchemaRecord] = {}
        self._channels: dict[int, Channel | None] = {}

    def declare(self, kind: int, content: bytes, where: str) -> None:
        """Take in a schema or a channel."""
        with faults_as_input_error(where):
            if kind == Opcode.SCHEMA:
                schema = SchemaRecord.read(_stream(content))
                self._schemas[schema.id] = schema
                return
            record = ChannelRecord.read(_stream(content))
            channel = self._channel(record)
        if record.id not in self._channels:
            self._channels[record.id] = channel if self._wanted(channel) else None

    def message(self, content: bytes, position: Position, where: str) -> RawMessage | None:
        """Return the message at a position, or None when its channel is not wanted."""
        with faults_as_input_error(where):
            head = position.start - _MESSAGE_HEAD.size
            channel_id, _, log_time, _ = _MESSAGE_HEAD.unpack_from(
                content[head : min(position.start, position.stop)]
            )
        if channel_id not in self._channels:
            raise _damaged(f"a message of channel {channel_id}, which was never declared", where)
        channel = self._channels[channel_id]
        if channel is None:
            return None
        payload = content[position.start : position.stop]
        return RawMessage(channel, log_time, position, payload)

    def _channel(self, record: ChannelRecord) -> Channel:
        schema = self._schemas[record.schema_id] if record.schema_id else None
        return Channel(
            topic=record.topic,
            message_encoding=record.message_encoding,
            schema_name=schema.name if schema else "",
            schema_encoding=schema.encoding if schema else "",
            schema_data=schema.data if schema else b"",
        )


@contextmanager
def _opened(path: str) -> Iterator[tuple[IO[bytes], int]]:
    try:
        _refuse_stream(path)
        file = Path(path).open("rb")  # noqa: SIM115  closed below; only opening may fail here
    except OSError as fault:
        raise InputError(f"cannot read it: {fault.strerror}", where=path) from fault
    with file:
        start = file.read(len(MAGIC))
        if start != MAGIC:
            raise _not_mcap(path, start)
        yield file, file.seek(0, 2)


def _refuse_stream(path: str) -> None:
    mode = Path(path).stat().st_mode
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise InputError(
            "expected a file, found a device or pipe",
            where=path,
            hint="an MCAP recording is read in more than one go: copy it into a file",
        )


def require_mcap(path: str) -> None:
    """Check that a file can be opened and begins as an MCAP file does.

    Raises:
        InputError: It cannot or does not.
    """
    with _opened(path):
        pass


def _not_mcap(path: str, start: bytes) -> InputError:
    found = f"a file that starts with {start!r}" if start else "an empty file"
    hints = [hint for magic, hint in _FOREIGN.items() if start.startswith(magic)]
    return InputError(
        f"expected an MCAP recording, found {found}", where=path, hint=hints[0] if hints else None
    )


def _damaged(found: str, where: str) -> InputError:
    return InputError(
        f"expected intact MCAP data, found damage: {found}",
        where=where,
        hint="`mcap recover` may save the rest",
    )


def _stream(content: bytes) -> ReadDataStream:
    return ReadDataStream(BytesIO(content))


def _head_at(file: IO[bytes], offset: int) -> tuple[int, int]:
    """Return opcode and length of the record at an offset, leaving the file at its content."""
    file.seek(offset)
    opcode, length = _RECORD_HEAD.unpack(
        file.read(_RECORD_HEAD.size).ljust(_RECORD_HEAD.size, b"\0")
    )
    return opcode, length


def _head_fault(opcode: int, length: int, left: int) -> str | None:
    """Return what is wrong with a record before which `left` bytes of the file remain, or None."""
    if opcode != 0 and length <= min(left - _RECORD_HEAD.size, MAX_RECORD_BYTES):
        return None
    return f"a record with opcode {opcode} and {length} bytes, {left} bytes before the end"


def _records(
    file: IO[bytes], size: int, *, cut: bool, path: str
) -> Iterator[tuple[int, int, bytes]]:
    """Yield offset, opcode and content of the relevant records of the data section."""
    offset = len(MAGIC)
    while offset + _RECORD_HEAD.size <= size:
        opcode, length = _head_at(file, offset)
        fault = _head_fault(opcode, length, size - offset)
        if opcode in _LAST or (fault and cut):
            return
        if fault:
            raise _damaged(fault, f"{path}, byte {offset}")
        if opcode in _RELEVANT:
            yield offset, opcode, file.read(length)
        offset += _RECORD_HEAD.size + length


def _entries(opcode: int, body: bytes, where: str) -> Iterator[tuple[int, bytes, int, int]]:
    """Yield opcode, bytes, start and stop of a record, or of each record inside a chunk."""
    if opcode != Opcode.CHUNK:
        yield opcode, body, 0, len(body)
        return
    content = _unpacked(body, where)
    start = 0
    while start < len(content):
        if start + _RECORD_HEAD.size > len(content):
            raise _damaged("a chunk that ends inside a record", where)
        kind, length = _RECORD_HEAD.unpack_from(content, start)
        start += _RECORD_HEAD.size
        if start + length > len(content):
            raise _damaged(f"a record of {length} bytes in a chunk of {len(content)}", where)
        yield kind, content, start, start + length
        start += length


def _unpacked(body: bytes, where: str) -> bytes:
    with faults_as_input_error(where):
        chunk = ChunkRecord.read(_stream(body))
        _check_chunk(chunk, where)
        stream, length = get_chunk_data_stream(chunk, validate_crc=True)
        return bytes(stream.read(length))


def _check_chunk(chunk: Any, where: str) -> None:
    """Refuse, before unpacking, what would be misread or would not fit into memory."""
    if chunk.compression not in _COMPRESSIONS:
        raise _damaged(f"a chunk with compression {chunk.compression!r}", where)
    sizes = [chunk.uncompressed_size]
    if chunk.compression == "zstd":
        sizes.append(zstandard.frame_content_size(chunk.data))
    if max(sizes) > MAX_RECORD_BYTES:
        raise _damaged(f"a chunk of {max(sizes)} bytes", where)
