"""The topics of a recording, counted."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from handeye_cli.recording.container import Channel, RawMessage
from handeye_cli.recording.decoding import decoder_for
from handeye_cli.records.recording_summary import TopicSummary


@dataclass
class _Tally:
    count: int
    first_ns: int
    last_ns: int

    def add(self, time_ns: int) -> None:
        self.count += 1
        self.first_ns = min(self.first_ns, time_ns)
        self.last_ns = max(self.last_ns, time_ns)

    @property
    def seconds(self) -> float:
        return (self.last_ns - self.first_ns) / 1e9


class TopicCounter:
    """Counts the messages it is told of."""

    def __init__(self) -> None:
        self._tallies: dict[Channel, _Tally] = {}

    def add(self, message: RawMessage) -> None:
        """Count a message."""
        time_ns = message.log_time_ns
        tally = self._tallies.get(message.channel)
        if tally is None:
            tally = self._tallies[message.channel] = _Tally(0, time_ns, time_ns)
        tally.add(time_ns)

    def duration(self) -> float:
        """Return the seconds from the first message to the last."""
        tallies = self._tallies.values()
        if not tallies:
            return 0.0
        first, last = min(each.first_ns for each in tallies), max(each.last_ns for each in tallies)
        return (last - first) / 1e9

    def topics(self, channels: Iterable[Channel]) -> tuple[TopicSummary, ...]:
        """Return all channels of a recording, in the order of their topics' names."""
        known = dict.fromkeys(channels)
        return tuple(self._topic(each) for each in sorted(known, key=lambda each: each.topic))

    def _topic(self, channel: Channel) -> TopicSummary:
        decoder, tally = decoder_for(channel), self._tallies.get(channel)
        count, seconds = (tally.count, tally.seconds) if tally else (0, 0.0)
        return TopicSummary(
            name=channel.topic,
            schema=channel.schema_name,
            encoding=channel.message_encoding,
            count=count,
            rate=(count - 1) / seconds if seconds > 0.0 else None,
            role=str(decoder.role) if decoder else "",
        )
