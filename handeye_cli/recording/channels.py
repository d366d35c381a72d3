"""The schemas and channels of a file: what kind of message each of its messages is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass

from mcap.opcode import Opcode
from mcap.records import Channel as ChannelRecord
from mcap.records import Schema as SchemaRecord

from handeye_cli.recording.framing import DamageError, faults_as_damage, stream_of

_MAX_BYTES = 2**26
"""More than any file declares; all of it stays in memory."""


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


class Channels:
    """The schemas and channels met so far, and how many messages each channel had.

    Args:
        wanted: Asked once for every channel.
        every: Whether messages are given that are not wanted, too.
    """

    def __init__(self, wanted: Callable[[Channel], bool], *, every: bool) -> None:
        self._wanted = wanted
        self._every = every
        self._schemas: dict[int, SchemaRecord] = {}
        self._channels: dict[int, Channel] = {}
        self._used: set[int] = set()
        self._given: set[int] = set()
        self._counts: Counter[int] = Counter()
        self._bytes = 0

    def declare(self, kind: int, content: bytes) -> None:
        """Take in a schema or a channel; what was said first holds.

        Raises:
            DamageError: It cannot be read, says something else than before, names a schema that was
                never declared, or is one too many.
        """
        self._bytes += len(content)
        if self._bytes > _MAX_BYTES:
            raise DamageError(f"more than {_MAX_BYTES} bytes of schemas and channels")
        with faults_as_damage("a schema or channel"):
            if kind == Opcode.SCHEMA:
                schema = SchemaRecord.read(stream_of(content))
                if self._schemas.setdefault(schema.id, schema) != schema:
                    raise DamageError(f"schema {schema.id} declared twice, with two contents")
                return
            record = ChannelRecord.read(stream_of(content))
        if record.schema_id and record.schema_id not in self._schemas:
            raise DamageError(f"{record.topic!r} of schema {record.schema_id}, never declared")
        channel = self._channel(record)
        known = self._channels.get(record.id)
        if known is not None and known != channel:
            named = f"{known.topic!r} and as {channel.topic!r}"
            raise DamageError(f"channel {record.id} declared twice, as {named}")
        if known is None:
            self._channels[record.id] = channel
            wanted = self._wanted(channel)
            self._used |= {record.id} if wanted else set()
            self._given |= {record.id} if wanted or self._every else set()

    def of_message(self, channel_id: int) -> Channel | None:
        """Return the channel of a message, or None when it is not to be given.

        Raises:
            DamageError: It was never declared.
        """
        if channel_id in self._given:
            self._counts[channel_id] += 1
            return self._channels[channel_id]
        if channel_id not in self._channels:
            raise DamageError(f"a message of channel {channel_id}, which was never declared")
        return None

    def all_known(self, channel_ids: Collection[int]) -> bool:
        """Return whether all of some channels were declared, and there is one."""
        return bool(channel_ids) and self._channels.keys() >= set(channel_ids)

    def none_wanted(self, channel_ids: Collection[int]) -> bool:
        """Return whether all of some channels are known, there is one, and none is wanted."""
        return self.all_known(channel_ids) and self._used.isdisjoint(channel_ids)

    def counted(self, stated: Iterable[tuple[int, int]]) -> Iterator[tuple[str, bool, int, int]]:
        """Yield what the messages of each channel that are given come to.

        Args:
            stated: Ids of channels, with numbers of messages.

        Yields:
            Topic, whether it is wanted, and the stated and the found number.
        """
        for channel_id, count in stated:
            if channel_id in self._given:
                channel, wanted = self._channels[channel_id], channel_id in self._used
                yield channel.topic, wanted, count, self._counts[channel_id]

    def _channel(self, record: ChannelRecord) -> Channel:
        schema = self._schemas.get(record.schema_id)
        return Channel(
            topic=record.topic,
            message_encoding=record.message_encoding,
            schema_name=schema.name if schema else "",
            schema_encoding=schema.encoding if schema else "",
            schema_data=schema.data if schema else b"",
        )
