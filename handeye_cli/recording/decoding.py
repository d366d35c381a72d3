"""From a payload to one of our messages, by the rows of the message table."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from types import ModuleType

import zstandard

from handeye_cli.errors import InputError
from handeye_cli.recording import message_table
from handeye_cli.recording.container import Channel
from handeye_cli.recording.in_order import Place, Trace
from handeye_cli.recording.layout import Layout, Values, parse
from handeye_cli.recording.messages import Header, Message, Role

MAX_MESSAGE_BYTES = 2**28
"""A message that was packed by itself and is longer is damage, or made to fill the memory."""

_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_FAULTS = (ValueError, OverflowError, RecursionError, struct.error, zstandard.ZstdError)
"""What decoders raise on damaged bytes."""


@dataclass(frozen=True)
class ChannelDecoder:
    """Reads the messages of one channel.

    Attributes:
        channel: The channel, of a schema in an encoding that have rows in the table.
        role: What its messages are good for.
    """

    channel: Channel
    role: Role

    def decode(self, data: bytes) -> Message:
        """Return a payload as a message.

        Raises:
            InputError: The payload is damaged or not of the channel's schema.
        """
        with self._faults_named():
            return _whole(self.channel)(_unpacked(data))

    def places(self, data: bytes) -> tuple[Place, ...]:
        """Return what stands where in a payload that can be read, in its order.

        It is empty for a payload that was packed by itself, and in encodings that do not hold the
        fields one after the other.
        """
        return _places(self.channel, data) if self.is_in_order(data) else ()

    def is_in_order(self, data: bytes) -> bool:
        """Return whether a payload holds its fields one after the other, and is not packed.

        Args:
            data: The payload or its beginning.
        """
        in_order = self.channel.message_encoding in message_table.IN_ORDER
        return in_order and not data.startswith(_ZSTD_MAGIC)

    def header(self, data: bytes) -> Header:
        """Return the header of an image without touching its pixels.

        Raises:
            InputError: The payload is damaged.
        """
        with self._faults_named():
            return _head(self.channel)(_unpacked(data))

    @contextmanager
    def _faults_named(self) -> Iterator[None]:
        try:
            yield
        except _FAULTS as fault:
            channel = self.channel
            raise InputError(
                f"expected an intact {channel.schema_name} in {channel.message_encoding},"
                f" found damage: {fault}",
                where=f"a message of {channel.topic}",
                hint="`mcap recover` may save the rest; if every message is like this, what wrote"
                " the file does not keep to the schema",
            ) from fault


def decoder_for(channel: Channel) -> ChannelDecoder | None:
    """Return the decoder of a channel, or None when schema and encoding are not in the table."""
    row = message_table.row_of(channel.schema_name, channel.message_encoding)
    return None if row is None else ChannelDecoder(channel, row.role)


@lru_cache(maxsize=64)
def _whole(channel: Channel) -> Callable[[bytes], Message]:
    module, layout = _schema(channel)
    generic = _generic(channel, layout)
    return lambda data: module.decode(generic(data))


@lru_cache(maxsize=64)
def _head(channel: Channel) -> Callable[[bytes], Header]:
    module, layout = _schema(channel)
    generic = _generic(channel, layout.first(module.HEAD_FIELDS))
    return lambda data: module.decode_head(generic(data))


def _places(channel: Channel, data: bytes) -> tuple[Place, ...]:
    traces = []

    def traced(payload: bytes, start: int) -> Trace:
        traces.append(Trace(payload, start))
        return traces[-1]

    _tracing(channel)(data, traced)
    return tuple(traces[0].places)


@lru_cache(maxsize=64)
def _tracing(channel: Channel) -> Callable[..., Values]:
    return _generic(channel, _schema(channel)[1])


def _schema(channel: Channel) -> tuple[ModuleType, Layout]:
    row = message_table.row_of(channel.schema_name, channel.message_encoding)
    if row is None:
        raise KeyError(channel.schema_name)
    module = import_module(row.module)
    return module, parse(module.DEFINITION, getattr(module, "NUMBERS", {}))


def _generic(channel: Channel, layout: Layout) -> Callable[[bytes], Values]:
    encoding = import_module(message_table.ENCODINGS[channel.message_encoding])
    decode: Callable[[bytes], Values] = encoding.decoder(layout)
    return decode


def _unpacked(data: bytes) -> bytes:
    """Return a payload as it was before rosbag2 packed it by itself (compression_mode MESSAGE)."""
    if not data.startswith(_ZSTD_MAGIC):
        return data
    stated = zstandard.frame_content_size(data)  # negative where the frame does not say
    _require_small(stated)
    limit = stated if stated >= 0 else MAX_MESSAGE_BYTES
    with zstandard.ZstdDecompressor().stream_reader(data) as stream:
        unpacked = stream.read(limit + 1)
    if stated not in (-1, len(unpacked)):
        raise ValueError(f"{len(unpacked)} of the {stated} bytes of a packed message")
    _require_small(len(unpacked))
    return unpacked


def _require_small(size: int) -> None:
    if size > MAX_MESSAGE_BYTES:
        raise ValueError(f"a packed message of more than {MAX_MESSAGE_BYTES} bytes")
