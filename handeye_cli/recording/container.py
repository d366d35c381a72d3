"""The MCAP container: which messages a file holds, and where; never more than one chunk in memory.

Records are framed by `framing`, by their length and against the file's, and parsed by the `mcap`
package. Its own readers are not used: depending on the layout they hold the whole file in memory,
give nothing at all for a file that was cut off, and lose messages silently when a length is
damaged. A file is read in its own order, since that needs no index, and payloads that are not asked
for are skipped where they stand in the file; times are sorted where they are used. What is damaged
is left out and counted.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import groupby
from typing import NamedTuple

from mcap.opcode import Opcode

from handeye_cli.recording.channels import Channel, Channels
from handeye_cli.recording.chunks import Content, content_of
from handeye_cli.recording.file_index import DECLARATIONS, summary_of
from handeye_cli.recording.framing import (
    MAGIC,
    DamageError,
    FileBytes,
    Record,
    Source,
    damaged,
    opened,
    records,
    require_mcap,
)
from handeye_cli.recording.losses import Losses

__all__ = [
    "Channel",
    "Position",
    "RawMessage",
    "read_payloads",
    "require_mcap",
    "scan",
]

_MESSAGE = int(Opcode.MESSAGE)
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_LAST = ((Opcode.DATA_END, 4), (Opcode.FOOTER, 20))
"""The records behind the messages, and their lengths."""
_SUSPICIOUS = {Opcode.DATA_END, Opcode.FOOTER, *range(0x10, 0x80)}
"""Kinds that no record here has, unless the byte that says it is damaged."""


class Position(NamedTuple):
    """Where a message's payload lies.

    Attributes:
        path: The file.
        chunk: Byte in the file at which the record of its chunk starts, when that is packed.
        start: First byte of the payload, in the file or in the unpacked content of the chunk.
        stop: The byte after the last.
    """

    path: str
    chunk: int | None
    start: int
    stop: int


class RawMessage(NamedTuple):
    """A message as it was recorded; its payload can be read until the scan goes on.

    Attributes:
        channel: Where it belongs.
        log_time_ns: When it was recorded.
        content: What it stands in.
        start: First byte of its payload in there.
        stop: The byte after the last.
    """

    channel: Channel
    log_time_ns: int
    content: Content
    start: int
    stop: int

    @property
    def position(self) -> Position:
        """Where its payload lies."""
        return Position(self.content.path, self.content.packed, self.start, self.stop)

    @property
    def data(self) -> bytes:
        """The payload.

        Raises:
            InputError: It is too long to be read.
        """
        return self._read(self.stop)

    def beginning(self, size: int) -> bytes:
        """Return the first bytes of the payload, or all when there are not so many.

        Raises:
            InputError: They are too many to be read.
        """
        return self._read(min(self.start + size, self.stop))

    def _read(self, stop: int) -> bytes:
        try:
            return self.content.source.read(self.start, stop)
        except DamageError as fault:
            raise damaged(str(fault), f"a message of {self.channel.topic}") from fault


def scan(
    path: str, wanted: Callable[[Channel], bool], losses: Losses, aside: Losses | None = None
) -> Iterator[RawMessage]:
    """Yield the messages of the wanted channels in the order of the file.

    A file that was cut off gives everything before the record that is incomplete. What is damaged
    is left out, from a single record to the rest of the file.

    Args:
        path: The MCAP file.
        wanted: Asked once for every channel.
        losses: Grows by what is missing and by what is damaged, as far as anything wanted may
            have been there.
        aside: Grows by what is lost of nothing but messages that are not wanted. Where it is given,
            those are yielded as well.

    Raises:
        InputError: The file cannot be opened or is no MCAP file.
    """
    with opened(path) as file:
        yield from _Scan(file, wanted, losses, aside).messages()


def read_payloads(positions: Iterable[Position]) -> Iterator[bytes]:
    """Yield the payloads at some positions, reading nothing else of their files.

    Raises:
        InputError: A file cannot be opened or is not the one the positions were found in.
    """
    for path, in_file in groupby(positions, key=lambda position: position.path):
        with opened(path) as file:
            for chunk, together in groupby(in_file, key=lambda position: position.chunk):
                source = file if chunk is None else _source_of(file, chunk)
                for position in together:
                    with _damage_at(path, position.start if chunk is None else chunk):
                        payload = source.read(position.start, position.stop)
                    yield payload


def _source_of(file: FileBytes, chunk: int) -> Source:
    with _damage_at(file.path, chunk):
        for record in records(file, chunk, file.size):
            if record.opcode != Opcode.CHUNK:
                raise DamageError(f"a record with opcode {record.opcode} in place of a chunk")
            return content_of(file, record).source
        raise DamageError("the end of the file in place of a chunk")


@contextmanager
def _damage_at(path: str, offset: int) -> Iterator[None]:
    try:
        yield
    except DamageError as fault:
        raise damaged(str(fault), f"{path}, byte {offset}") from fault


class _Scan:
    """One way through a file."""

    def __init__(
        self,
        file: FileBytes,
        wanted: Callable[[Channel], bool],
        losses: Losses,
        aside: Losses | None,
    ) -> None:
        self._file = file
        self._content = Content(file.path, file, len(MAGIC), file.size, None)
        self._losses, self._aside = losses, aside
        self._summary = summary_of(file)
        self._channels = Channels(wanted, every=aside is not None)
        for record in self._summary.declarations:
            with suppress(DamageError):  # the messages' part of the file declares it again
                self._channels.declare(record.opcode, file.read(record.start, record.stop))
        # otherwise a chunk without a message of use may still declare what others need
        self._may_skip = self._channels.all_known(self._summary.counts)

    def messages(self) -> Iterator[RawMessage]:
        """Yield the messages of the wanted channels."""
        offset: int | None = len(MAGIC)
        while offset is not None:
            try:
                for record in records(self._file, offset, self._summary.start):
                    if (record.opcode, record.stop - record.start) in _LAST:
                        break
                    yield from self._record(record)
                offset = None
            except DamageError as fault:
                offset = self._behind(fault)
        self._finish()

    def _behind(self, fault: DamageError) -> int | None:
        """Return where reading goes on behind a record that is not one, or None."""
        if self._file.is_cut:
            self._losses.cut_bytes += self._file.size - fault.offset
            return None
        following = self._summary.chunk_after(fault.offset)
        stop = self._summary.start if following is None else following
        self._lose(fault.offset, str(fault), stop - fault.offset, self._losses)
        return following

    def _finish(self) -> None:
        self._losses.cut += self._file.is_cut
        for topic, wanted, stated, found in self._channels.counted(self._summary.counts.items()):
            losses = self._losses if wanted else self._aside
            if losses is None or found >= stated:
                continue
            losses.messages += stated - found
            if not losses.places:
                counted = f"{found} messages of {topic}, of which it counts {stated}"
                self._lose(0, counted, 0, losses)

    def _record(self, record: Record) -> Iterator[RawMessage]:
        size = record.stop - record.start
        if record.opcode == Opcode.CHUNK:
            yield from self._chunk(record)
        elif record.opcode == Opcode.MESSAGE or record.opcode in DECLARATIONS:
            message = self._entry(self._content, record, self._losses)
            if message is not None:
                yield message
        elif record.opcode in _SUSPICIOUS:
            found = f"a record with opcode {record.opcode} and {size} bytes"
            self._lose(record.offset, found, record.stop - record.offset, self._losses)

    def _chunk(self, chunk: Record) -> Iterator[RawMessage]:
        """Yield the messages in a chunk; what is behind a broken record in it is lost."""
        ids = self._summary.channels_in(chunk)
        passed = self._may_skip and self._channels.none_wanted(ids)
        losses = self._aside if passed else self._losses
        if losses is None:
            return
        left = chunk.stop - chunk.offset
        try:
            content = content_of(self._file, chunk)
            left = content.stop - content.start
            for record in content.entries():
                message = self._entry(content, record, losses)
                if message is not None:
                    yield message
                left = content.stop - record.stop
        except DamageError as fault:
            self._lose(chunk.offset, str(fault), left, losses)

    def _entry(self, content: Content, record: Record, losses: Losses) -> RawMessage | None:
        """Return a message that is wanted; take in a declaration; count what is neither."""
        try:
            if record.opcode == _MESSAGE:
                return self._message(content, record)
            declared = content.source.read(record.start, record.stop)
            self._channels.declare(record.opcode, declared)
        except DamageError as fault:
            offset = record.offset if content.packed is None else content.packed
            self._lose(offset, str(fault), record.stop - record.offset, losses)
        return None

    def _message(self, content: Content, record: Record) -> RawMessage | None:
        start = record.start + _MESSAGE_HEAD.size
        if start > record.stop:
            raise DamageError(f"a message of {record.stop - record.start} bytes")
        channel_id, _, log_time, _ = content.source.unpack(_MESSAGE_HEAD, record.start)
        channel = self._channels.of_message(channel_id)
        if channel is None:
            return None
        return RawMessage(channel, log_time, content, start, record.stop)

    def _lose(self, offset: int, found: str, size: int, losses: Losses) -> None:
        losses.add(f"{self._file.path}, byte {offset}", found, size)
