"""From a payload to one of our messages, by the rows of the message table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from typing import Any

from handeye_cli.errors import InputError
from handeye_cli.recording import message_table
from handeye_cli.recording.container import Channel, faults_as_input_error
from handeye_cli.recording.messages import Header, Message, Role

_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"


@dataclass(frozen=True)
class ChannelDecoder:
    """Reads the messages of one channel.

    Attributes:
        channel: The channel, of a schema and an encoding that have rows in the table.
        role: What its messages are good for.
    """

    channel: Channel
    role: Role

    def decode(self, data: bytes) -> Message:
        """Return a payload as a message.

        Raises:
            InputError: The payload is damaged or not of the channel's schema.
        """
        self._refuse_packed(data)
        readers = _readers(self.channel)
        with faults_as_input_error(self._where):
            return readers.specific(readers.generic(data))

    def header(self, data: bytes) -> Header:
        """Return the header a payload starts with, without reading the rest of it.

        Raises:
            InputError: The payload is damaged.
        """
        self._refuse_packed(data)
        readers = _readers(self.channel)
        with faults_as_input_error(self._where):
            return readers.header(data)

    @property
    def _where(self) -> str:
        return f"a message of {self.channel.topic}"

    def _refuse_packed(self, data: bytes) -> None:
        if data.startswith(_ZSTD_MAGIC):
            raise InputError(
                "expected plain messages, found each one compressed by itself",
                where=self._where,
                hint="it was recorded with compression_mode MESSAGE: convert it with"
                " `ros2 bag convert` to compression_mode NONE or FILE",
            )


@dataclass(frozen=True)
class _Readers:
    generic: Callable[[bytes], Any]
    specific: Callable[[Any], Message]
    header: Callable[[bytes], Header]


def decoder_for(channel: Channel) -> ChannelDecoder | None:
    """Return the decoder of a channel, or None when its schema or encoding is not in the table."""
    row = message_table.row_of(channel.schema_name)
    if row is None or channel.message_encoding not in message_table.ENCODINGS:
        return None
    return ChannelDecoder(channel, row.role)


@lru_cache(maxsize=64)
def _readers(channel: Channel) -> _Readers:
    row = message_table.row_of(channel.schema_name)
    if row is None:
        raise KeyError(channel.schema_name)
    schema = import_module(row.module)
    encoding = import_module(message_table.ENCODINGS[channel.message_encoding])
    generic = encoding.decoder(channel, schema.DEFINITION)
    return _Readers(generic=generic, specific=schema.decode, header=encoding.header)
