"""What an MCAP file says of itself at its end: only a help, and only when its checksum is right."""

from __future__ import annotations

import struct
import zlib
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field

from mcap.opcode import Opcode
from mcap.records import ChunkIndex, Statistics

from handeye_cli.recording.framing import (
    MAGIC,
    RECORD_HEAD,
    DamageError,
    FileBytes,
    Record,
    faults_as_damage,
    records,
    stream_of,
)

DECLARATIONS = (Opcode.SCHEMA, Opcode.CHANNEL)
_FOOTER = struct.Struct("<QQI")
_CHECKSUM_BYTES = 4


@dataclass(frozen=True)
class ChunkEntry:
    """What the index says of a chunk.

    Attributes:
        stop: The byte after its record.
        channels: Ids of the channels that have messages in it; empty when that is not known.
    """

    stop: int
    channels: frozenset[int]


@dataclass(frozen=True)
class Summary:
    """The summary of a file, or the want of one.

    Attributes:
        start: Where the messages end.
        declarations: The schemas and channels, where they are repeated in the file.
        counts: Numbers of messages by channel id; empty when that is not known.
        chunks: Index entries by the offset of the chunk.
    """

    start: int
    declarations: tuple[Record, ...] = ()
    counts: Mapping[int, int] = field(default_factory=dict)
    chunks: Mapping[int, ChunkEntry] = field(default_factory=dict)

    def channels_in(self, chunk: Record) -> frozenset[int]:
        """Return the ids of the channels with messages in a chunk; empty when not known."""
        entry = self.chunks.get(chunk.offset)
        return entry.channels if entry and entry.stop == chunk.stop else frozenset()

    def chunk_after(self, offset: int) -> int | None:
        """Return where the next chunk behind an offset starts, or None when that is not known."""
        starts = list(self.chunks)
        index = bisect_right(starts, offset)
        return starts[index] if index < len(starts) else None


def summary_of(file: FileBytes) -> Summary:
    """Return the summary of a file; an empty one when it is missing, damaged or not checked."""
    if file.is_cut:
        return Summary(file.size)
    end = file.size - len(MAGIC)
    try:
        return _read(file, end) or Summary(end)
    except DamageError:  # the messages themselves are read without it
        return Summary(end)


def _read(file: FileBytes, end: int) -> Summary | None:
    footer = end - RECORD_HEAD.size - _FOOTER.size
    if footer < len(MAGIC):
        return None
    raw = file.read(footer, end)
    if raw[: RECORD_HEAD.size] != RECORD_HEAD.pack(Opcode.FOOTER, _FOOTER.size):
        return None
    start, _, checksum = _FOOTER.unpack_from(raw, RECORD_HEAD.size)
    if not checksum or not len(MAGIC) <= start <= footer:
        return None
    if zlib.crc32(raw[:-_CHECKSUM_BYTES], zlib.crc32(file.read(start, footer))) != checksum:
        return None
    return _parsed(file, start, footer)


def _parsed(file: FileBytes, start: int, stop: int) -> Summary:
    declarations: list[Record] = []
    counts: dict[int, int] = {}
    chunks: dict[int, ChunkEntry] = {}
    for record in records(file, start, stop):
        if record.opcode in DECLARATIONS:
            declarations.append(record)
            continue
        content = file.read(record.start, record.stop)
        with faults_as_damage("a summary"):
            if record.opcode == Opcode.STATISTICS:
                counts = Statistics.read(stream_of(content)).channel_message_counts
            elif record.opcode == Opcode.CHUNK_INDEX:
                index = ChunkIndex.read(stream_of(content))
                channels = frozenset(index.message_index_offsets)
                entry = ChunkEntry(index.chunk_start_offset + index.chunk_length, channels)
                chunks[index.chunk_start_offset] = entry
    inside = {at: entry for at, entry in sorted(chunks.items()) if at < entry.stop <= start}
    return Summary(start, tuple(declarations), counts, inside)
