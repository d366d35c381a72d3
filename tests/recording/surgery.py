"""Taking MCAP files apart, byte by byte, and putting them together wrongly."""

import struct
import zlib
from dataclasses import dataclass
from functools import partial

import lz4.frame
import zstandard

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX = range(1, 8)
CHUNK_INDEX, STATISTICS, DATA_END = 8, 11, 15
FOOTER_BYTES = 9 + 20
MESSAGE_HEAD = 22
SIZE_IN_CHUNK, CHECKSUM_IN_CHUNK = 16, 24
"""Where a chunk's content says how large its records are when unpacked, and their checksum."""


@dataclass(frozen=True)
class Record:
    """A record as it stands in bytes: of a kind, its content between start and stop."""

    opcode: int
    offset: int
    start: int
    stop: int


def record(opcode, content):
    return struct.pack("<BQ", opcode, len(content)) + content


def text(words):
    raw = words if isinstance(words, bytes) else words.encode()
    return struct.pack("<I", len(raw)) + raw


def chunk_of(content, compression="", data=None, *, size=None, checksum=0):
    """Return a chunk record; `data` and `size` say other than what the content is."""
    size = len(content) if size is None else size
    data = content if data is None else data
    head = struct.pack("<QQQI", 0, 0, size, checksum) + text(compression)
    return record(CHUNK, head + struct.pack("<Q", len(data)) + data)


def message(channel_id, payload=b"", time=0):
    return record(MESSAGE, struct.pack("<HIQQ", channel_id, 0, time, time) + payload)


def schema(schema_id, name, encoding="ros2msg", data=b""):
    return record(SCHEMA, struct.pack("<H", schema_id) + text(name) + text(encoding) + text(data))


def channel(channel_id, schema_id, topic, encoding="cdr"):
    head = struct.pack("<HH", channel_id, schema_id)
    return record(CHANNEL, head + text(topic) + text(encoding) + text(b""))


def ended(records):
    """Return a file of some records, without a summary."""
    end = record(DATA_END, bytes(4)) + record(FOOTER, bytes(20))
    return MAGIC + record(HEADER, bytes(8)) + records + end + MAGIC


def records(raw, start=None, stop=None):
    """Return the records of a whole file, or of a part of it."""
    found = []
    start = len(MAGIC) if start is None else start
    stop = len(raw) - len(MAGIC) if stop is None else stop
    while start < stop:
        opcode, length = struct.unpack_from("<BQ", raw, start)
        found.append(Record(opcode, start, start + 9, start + 9 + length))
        start += 9 + length
    return found


def of_kind(raw, opcode):
    return [each for each in records(raw) if each.opcode == opcode]


def middle(raw, opcode=CHUNK):
    found = of_kind(raw, opcode)
    return found[len(found) // 2]


def data_of(raw, chunk):
    """Return where the data of a chunk start."""
    (name,) = struct.unpack_from("<I", raw, chunk.start + 28)
    return chunk.start + 32 + name + 8


def inside(raw, chunk):
    """Return the records inside a chunk that is not packed."""
    return records(raw, data_of(raw, chunk), chunk.stop)


def put(raw, offset, new):
    return raw[:offset] + new + raw[offset + len(new) :]


def flipped(raw, offset):
    return put(raw, offset, bytes([raw[offset] ^ 0x55]))


def number(raw, offset, value, code="Q"):
    return put(raw, offset, struct.pack("<" + code, value))


def without(raw, *spans):
    """Return the bytes without some records; offsets in the file are not corrected."""
    for each in sorted(spans, key=lambda span: -span.offset):
        raw = raw[: each.offset] + raw[each.stop :]
    return raw


def inserted(raw, offset, new):
    return raw[:offset] + new + raw[offset:]


def summary_start(raw):
    return struct.unpack_from("<Q", raw, len(raw) - len(MAGIC) - 20)[0]


def signed(raw, start=None):
    """Return a file whose summary starts where it says and has the right checksum."""
    if start is None:
        start = next(each.stop for each in records(raw) if each.opcode == DATA_END)
    footer = len(raw) - len(MAGIC) - FOOTER_BYTES
    raw = number(raw, footer + 9, start)
    checksum = zlib.crc32(raw[start : footer + 9 + 16])
    return number(raw, footer + 9 + 16, checksum, "I")


def zstd_bomb(size, *, told):
    """Return a frame of zeros in one block of four bytes for each 128 kB; `told` says the size."""
    block = 2**17
    head = b"\x28\xb5\x2f\xfd" + (b"\xc0" if told else b"\x00") + b"\x38"
    blocks = [(block << 3 | 1 << 1).to_bytes(3, "little") + b"\0"] * (size // block)
    blocks[-1] = (block << 3 | 1 << 1 | 1).to_bytes(3, "little") + b"\0"
    return head + (struct.pack("<Q", size) if told else b"") + b"".join(blocks)


def lz4_bomb(size):
    """Return a frame of zeros in equal blocks of 4 MB."""
    block = 2**22
    pack = lz4.frame.LZ4FrameCompressor(
        block_size=lz4.frame.BLOCKSIZE_MAX4MB, block_linked=False, auto_flush=True
    )
    head = pack.begin()
    return head + pack.compress(bytes(block)) * (size // block) + pack.flush()


PACK = {"zstd": partial(zstandard.compress, level=1), "lz4": lz4.frame.compress, "": bytes}
