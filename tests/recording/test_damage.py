"""Damaged files, one row per damage: what is not damaged is used, and what is lost is told of."""

import json
import re
import struct
import subprocess
import sys
import zlib
from collections import Counter
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path

import pytest
from mcap.writer import CompressionType, IndexType
from recording import bags, surgery
from recording.surgery import (
    CHANNEL,
    CHUNK,
    CHUNK_INDEX,
    DATA_END,
    FOOTER,
    FOOTER_BYTES,
    MAGIC,
    MESSAGE,
    MESSAGE_HEAD,
    MESSAGE_INDEX,
    SCHEMA,
    STATISTICS,
    chunk_of,
    data_of,
    ended,
    flipped,
    inserted,
    inside,
    middle,
    number,
    of_kind,
    put,
    records,
    signed,
    summary_start,
    without,
)

from handeye_cli import recording
from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError
from handeye_cli.recording import container, framing
from handeye_cli.recording.losses import Losses

STATIONS = 4
OPTIONS = recording.McapOptions(setup=Setup.EYE_IN_HAND)
TF, IMAGE = "/tf", "/camera/image_raw"
NO_SUMMARY = {
    "index_types": IndexType.NONE,
    "repeat_channels": False,
    "repeat_schemas": False,
    "use_statistics": False,
    "use_summary_offsets": False,
}
BASES = {
    "zstd": {"compression": CompressionType.ZSTD},
    "lz4": {"compression": CompressionType.LZ4},
    "plain": {"compression": CompressionType.NONE},
    "no-crc": {"compression": CompressionType.NONE, "enable_crcs": False},
    "bare": {"compression": CompressionType.NONE, "enable_crcs": False, **NO_SUMMARY},
    "packed-bare": {"compression": CompressionType.ZSTD, **NO_SUMMARY},
    "unchunked": {"use_chunking": False},
    "unchunked-bare": {"use_chunking": False, **NO_SUMMARY},
}


@pytest.fixture(scope="module")
def messages():
    return bags.Robot(rate=30.0, image_rate=10.0).messages()


@pytest.fixture(scope="module")
def good(tmp_path_factory, messages):
    """Return the bytes of an undamaged recording in some layout."""
    folder = tmp_path_factory.mktemp("good")

    @lru_cache
    def of(base):
        path = bags.write(folder / f"{base}.mcap", messages, chunk_size=8000, **BASES[base])
        return Path(path).read_bytes()

    return of


@dataclass(frozen=True)
class Some:
    """So many stations are found, and of our findings those with these codes."""

    stations: int
    codes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Refused:
    """The recording is refused with these words."""

    words: tuple[str, ...]


All = partial(Some, STATIONS)
CUT, DAMAGED, UNREADABLE = "recording-cut", "recording-damaged", "messages-unreadable"
OURS = {CUT, DAMAGED, UNREADABLE}


def in_middle(change, opcode=CHUNK):
    """Change the record of some kind in the middle of the file."""
    return lambda raw: change(raw, middle(raw, opcode))


def cut(fraction):
    return lambda raw: raw[: int(fraction * len(raw))]


def cut_before_end(count):
    return lambda raw: raw[: len(raw) - count]


def of_message(raw, topic, change):
    """Change the message of a topic in the middle of the middle chunk that has one."""
    ids = ids_of(raw, topic)
    groups = [messages_in(raw, chunk, ids) for chunk in of_kind(raw, CHUNK) or [None]]
    groups = [group for group in groups if len(group) > 1]
    chosen = groups[len(groups) // 2]
    return change(raw, chosen[len(chosen) // 2])


def ids_of(raw, topic):
    return [
        struct.unpack_from("<H", raw, each.start)[0]
        for each in channels(raw)
        if topic_of(raw, each) == topic
    ]


def channels(raw):
    chunks = of_kind(raw, CHUNK)
    places = [each for chunk in chunks for each in inside(raw, chunk)] if chunks else records(raw)
    return [each for each in places if each.opcode == CHANNEL]


def topic_of(raw, found):
    (length,) = struct.unpack_from("<I", raw, found.start + 4)
    return raw[found.start + 8 : found.start + 8 + length].decode()


def messages_in(raw, chunk, channel_ids):
    return [
        each
        for each in (records(raw) if chunk is None else inside(raw, chunk))
        if each.opcode == MESSAGE and struct.unpack_from("<H", raw, each.start)[0] in channel_ids
    ]


def in_message(topic, change):
    return lambda raw: of_message(raw, topic, change)


def payload(new):
    """Begin a payload with other bytes."""
    return lambda raw, found: put(raw, found.start + MESSAGE_HEAD, new)


def longer(by):
    """Say another length of a record than it has."""

    def change(raw, found):
        return number(raw, found.offset + 1, found.stop - found.start + by)

    return change


def every_payload(topic, new):
    """Begin every payload of a topic, in a file without chunks, with other bytes."""

    def change(raw):
        for found in messages_in(raw, None, ids_of(raw, topic)):
            raw = put(raw, found.start + MESSAGE_HEAD, new)
        return raw

    return change


def in_summary(opcode, change):
    """Change every record of a kind in the summary, whose checksum is made right again."""

    def changed(raw):
        start = summary_start(raw)
        for each in reversed(of_kind(raw, opcode)):
            if each.offset >= start:
                raw = change(raw, each)
        return signed(raw, start)

    return changed


def repacked(compression, content_of=bytes, **told):
    """Replace the middle chunk, plain before, by another one with the same or other content."""

    def change(raw, found):
        content = content_of(raw[data_of(raw, found) : found.stop])
        data = surgery.PACK[compression](content)
        new = chunk_of(content, compression, data, **told)
        return raw[: found.offset] + new + raw[found.stop :]

    return in_middle(change)


def first_chunk(change):
    return lambda raw: change(raw, of_kind(raw, CHUNK)[0])


def every_chunk(change):
    def changed(raw):
        for each in of_kind(raw, CHUNK):
            raw = change(raw, each)
        return raw

    return changed


def spoilt(raw, chunk):
    return flipped(raw, (data_of(raw, chunk) + chunk.stop) // 2)


def with_opcode(opcode):
    return lambda raw, found: put(raw, found.offset, bytes([opcode]))


def removed(opcode, first=None):
    """Take records of a kind out of the file, offsets staying as they were."""
    return lambda raw: without(raw, *of_kind(raw, opcode)[:first])


def data_length(value):
    return lambda raw, chunk: number(raw, data_of(raw, chunk) - 8, value)


def declared_again(raw):
    """Declare the channel of /tf once more, in another chunk, as one of pictures."""
    (tf,) = [each for each in channels(raw) if topic_of(raw, each) == TF]
    tf_id, schema_id = struct.unpack_from("<HH", raw, tf.start)
    again = surgery.channel(tf_id, schema_id, "/other")
    return inserted(raw, middle(raw).offset, chunk_of(again))


def before_its_channel(raw):
    """Put a message of a channel that is declared later in front of everything."""
    return inserted(raw, of_kind(raw, CHUNK)[0].offset, surgery.message(1, bytes(90)))


def unchannelled(raw):
    """Lose the declarations, which stand in the first chunk and nowhere else."""
    return first_chunk(data_length(2**50))(raw)


RAW_END = cut_before_end(len(MAGIC))
ROWS = {
    # not a recording
    "empty": ("zstd", lambda raw: b"", Refused(("an empty file",))),
    "three-bytes": ("zstd", lambda raw: raw[:3], Refused(("starts with b'\\x89MC'",))),
    "only-magic": ("zstd", lambda raw: raw[:8], Refused(("no channels at all", "cut off"))),
    "both-magics": ("zstd", lambda raw: MAGIC * 2, Refused(("no channels at all",))),
    "png": ("zstd", lambda raw: b"\x89PNG\r\n\x1a\n" + raw, Refused(("starts with b'\\x89PNG",))),
    "text": ("zstd", lambda raw: b"hello, world", Refused(("starts with b'hello, w'",))),
    "zeros": ("zstd", lambda raw: MAGIC + bytes(999) + MAGIC, Refused(("byte 8", "opcode 0"))),
    "wrong-magic": ("zstd", lambda raw: b"\x89MCAP1\r\n" + raw[8:], Refused(("MCAP1",))),
    # without its end
    "cut-half": ("zstd", cut(0.5), Some(2, (CUT,))),
    "cut-half-unchunked": ("unchunked", cut(0.5), Some(2, (CUT,))),
    "cut-half-plain": ("no-crc", cut(0.5), Some(2, (CUT,))),
    "cut-most": ("zstd", cut(0.9), All((CUT,))),
    "cut-at-start": ("zstd", lambda raw: raw[:300], Refused(("an image topic", "cut off"))),
    "cut-in-summary": ("zstd", lambda raw: raw[: summary_start(raw) + 50], All((CUT,))),
    "cut-in-footer": ("zstd", cut_before_end(len(MAGIC) + 9), All((CUT,))),
    "no-end-magic": ("zstd", RAW_END, All((CUT,))),
    "no-end-magic-bare": ("bare", RAW_END, All((CUT,))),
    "end-magic-damaged": ("zstd", lambda raw: flipped(raw, len(raw) - 3), All((CUT,))),
    "zeros-behind-half": ("unchunked", lambda raw: cut(0.5)(raw) + bytes(9999), Some(2, (CUT,))),
    # a byte that is another one
    "flipped-zstd": ("zstd", in_middle(spoilt), All((DAMAGED,))),
    "flipped-lz4": ("lz4", in_middle(spoilt), All((DAMAGED,))),
    "flipped-plain": ("plain", in_middle(spoilt), All((DAMAGED,))),
    "flipped-packed-bare": ("packed-bare", in_middle(spoilt), All((DAMAGED,))),
    "flipped-checksum": (
        "plain",
        in_middle(lambda raw, chunk: flipped(raw, chunk.start + surgery.CHECKSUM_IN_CHUNK)),
        All((DAMAGED,)),
    ),
    "flipped-everywhere": ("plain", every_chunk(spoilt), Refused(("is damaged", "checksum"))),
    "flipped-pixel": (  # nothing can tell
        "no-crc", in_message(IMAGE, lambda raw, found: flipped(raw, found.stop - 9)), All(),
    ),
    "flipped-summary": ("zstd", lambda raw: flipped(raw, summary_start(raw) + 40), All()),
    "flipped-opcode-of-chunk": ("plain", in_middle(with_opcode(0x55)), All((DAMAGED,))),
    "chunk-as-private-record": ("plain", in_middle(with_opcode(0x95)), All((DAMAGED,))),
    "chunk-as-data-end": ("plain", in_middle(with_opcode(DATA_END)), All((DAMAGED,))),
    "chunk-as-footer": ("bare", in_middle(with_opcode(FOOTER)), All((DAMAGED,))),
    "chunk-without-kind": ("plain", in_middle(with_opcode(0)), All((DAMAGED,))),
    "chunk-without-kind-bare": ("bare", in_middle(with_opcode(0)), Some(2, (DAMAGED,))),
    "kind-inside-chunk": ("no-crc", in_message(TF, with_opcode(0x99)), All((DAMAGED,))),
    "message-as-data-end": (
        "unchunked-bare", in_middle(with_opcode(DATA_END), MESSAGE), All((DAMAGED,)),
    ),
    # lengths
    "message-huge": ("no-crc", in_message(TF, longer(2**40)), All((DAMAGED,))),
    "message-longer": ("no-crc", in_message(TF, longer(7)), All((DAMAGED,))),
    "message-shorter": ("no-crc", in_message(TF, longer(-7)), All((DAMAGED, UNREADABLE))),
    "message-longer-unchunked": (
        "unchunked-bare", in_message(TF, longer(7)), Some(2, (DAMAGED,)),
    ),
    "message-huge-unchunked": ("unchunked", in_message(TF, longer(2**62)), Some(2, (DAMAGED,))),
    "message-without-head": (
        "bare",
        lambda raw: inserted(raw, middle(raw).offset, surgery.record(MESSAGE, b"short")),
        All((DAMAGED,)),
    ),
    "chunk-data-huge": ("plain", in_middle(data_length(2**50)), All((DAMAGED,))),
    "chunk-data-shorter": ("bare", in_middle(data_length(100)), All((DAMAGED,))),
    "chunk-huge": ("plain", in_middle(longer(2**62)), All((DAMAGED,))),
    "chunk-huge-bare": ("bare", in_middle(longer(2**62)), Some(2, (DAMAGED,))),
    "chunk-longer": ("plain", in_middle(longer(1000)), All((DAMAGED,))),
    "chunk-shorter": ("plain", in_middle(longer(-1000)), All((DAMAGED,))),
    "name-of-compression-huge": (
        "plain",
        in_middle(lambda raw, chunk: number(raw, chunk.start + 28, 2**31, "I")),
        All((DAMAGED,)),
    ),
    "chunk-without-content": (
        "bare",
        lambda raw: inserted(raw, middle(raw).offset, surgery.record(CHUNK, b"")),
        All((DAMAGED,)),
    ),
    "chunk-without-records": (
        "bare", lambda raw: inserted(raw, middle(raw).offset, chunk_of(b"")), All(),
    ),
    "packed-chunk-without-records": (
        "bare", lambda raw: inserted(raw, middle(raw).offset, chunk_of(b"", "lz4")), All(),
    ),
    "chunk-in-chunk": (
        "bare",
        lambda raw: inserted(raw, middle(raw).offset, chunk_of(chunk_of(b""))),
        All((DAMAGED,)),
    ),
    # packing
    "compression-unknown": (
        "bare",
        in_middle(
            lambda raw, chunk: raw[: chunk.offset] + chunk_of(b"x", "br") + raw[chunk.stop :]
        ),
        All((DAMAGED,)),
    ),
    "repacked": ("bare", repacked("zstd"), All()),
    "unpacks-to-less": ("bare", repacked("zstd", size=2**24), All((DAMAGED,))),
    "unpacks-to-more": ("bare", repacked("zstd", size=10), All((DAMAGED,))),
    "unpacks-to-terabytes": ("bare", repacked("zstd", size=2**40), All((DAMAGED,))),
    "lz4-unpacks-to-less": ("bare", repacked("lz4", size=2**24), All((DAMAGED,))),
    "lz4-unpacks-to-more": ("bare", repacked("lz4", size=10), All((DAMAGED,))),
    "lz4-unpacks-to-terabytes": ("bare", repacked("lz4", size=2**40), All((DAMAGED,))),
    "plain-of-other-size": ("bare", repacked("", size=10), All((DAMAGED,))),
    # the summary
    "index-elsewhere": (
        "plain",
        lambda raw: number(raw, of_kind(raw, CHUNK_INDEX)[0].start + 16, 12345),
        All(),
    ),
    "index-elsewhere-signed": (
        "plain",
        in_summary(CHUNK_INDEX, lambda raw, found: number(raw, found.start + 16, 12345)),
        All(),
    ),
    "index-out-of-file": (
        "plain",
        in_summary(CHUNK_INDEX, lambda raw, found: number(raw, found.start + 16, 2**63)),
        All(),
    ),
    "index-garbage": (
        "plain",
        in_summary(CHUNK_INDEX, lambda raw, found: put(raw, found.start + 32, b"\xff" * 4)),
        All(),
    ),
    "summary-out-of-file": (
        "zstd",
        lambda raw: number(raw, len(raw) - len(MAGIC) - FOOTER_BYTES + 9, 2**60),
        All(),
    ),
    "summary-unsigned": (
        "zstd", lambda raw: number(raw, len(raw) - len(MAGIC) - 4, 0, "I"), All(),
    ),
    "no-summary": ("packed-bare", bytes, All()),
    "summary-without-channels": ("zstd", in_summary(CHANNEL, without), All()),
    "summary-without-schemas": ("zstd", in_summary(SCHEMA, without), All()),
    "no-message-index": ("zstd", removed(MESSAGE_INDEX), All()),
    "no-chunk-index": ("zstd", in_summary(CHUNK_INDEX, without), All()),
    "counts-more": (
        "zstd",
        in_summary(STATISTICS, lambda raw, found: number(raw, found.stop - 8, 10**6)),
        All((DAMAGED,)),
    ),
    # schemas and channels
    "first-chunk": ("zstd", first_chunk(spoilt), All((DAMAGED,))),
    "first-chunk-bare": ("packed-bare", first_chunk(spoilt), Refused(("is damaged", "checksum"))),
    "no-declarations": ("bare", unchannelled, Refused(("is damaged", str(2**50)))),
    "no-schema": ("unchunked-bare", removed(SCHEMA, 1), All((DAMAGED,))),
    "no-channel": ("unchunked-bare", removed(CHANNEL, 1), All((DAMAGED,))),
    "no-schemas": (
        "unchunked-bare", removed(SCHEMA), Refused(("is damaged", "of schema 1, never declared")),
    ),
    "no-channels": (
        "unchunked-bare", removed(CHANNEL), Refused(("is damaged", "a message of channel 1")),
    ),
    "channel-declared-twice": ("bare", declared_again, All((DAMAGED,))),
    "message-before-channel": ("bare", before_its_channel, All((DAMAGED,))),
    "schema-text-beyond-record": (
        "bare",
        lambda raw: inserted(
            raw, middle(raw).offset, surgery.record(SCHEMA, struct.pack("<HI", 9, 10**9))
        ),
        All((DAMAGED,)),
    ),
    # payloads
    "payload-of-wrong-kind": ("no-crc", in_message(TF, payload(b"\x77\x77")), All((UNREADABLE,))),
    "sequence-huge": (
        "no-crc", in_message(TF, payload(b"\0\1\0\0" + b"\xff" * 4)), All((UNREADABLE,)),
    ),
    "text-huge": (
        "no-crc",
        in_message(TF, lambda raw, found: put(raw, found.start + 22 + 16, b"\xff" * 4)),
        All((UNREADABLE,)),
    ),
    "text-not-utf8": (
        "no-crc",
        in_message(TF, lambda raw, found: put(raw, found.start + 22 + 20, b"\xff\xff")),
        All((UNREADABLE,)),
    ),
    "every-picture": (
        "unchunked-bare",
        every_payload(IMAGE, b"\x77\x77"),
        Refused(("expected an image topic", f"no message of {IMAGE} can be read")),
    ),
}  # fmt: skip
"""The layout of a good file, what is done to its bytes, and what becomes of it."""


def outcome(path):
    """Return the number of stations and the codes of our findings."""
    read = recording.read(path, OPTIONS)
    return len(read.stations), {finding.code for finding in read.findings} & OURS


def told(path, losses):
    """Return topic and time of every message, counted."""
    found = container.scan(path, lambda channel: True, losses)
    return Counter((message.channel.topic, message.log_time_ns) for message in found)


@pytest.fixture
def damaged(good, tmp_path):
    """Write a damaged recording and return its path, and that of the good one."""

    def make(row):
        base, change, _ = ROWS[row]
        (tmp_path / "good.mcap").write_bytes(good(base))
        (tmp_path / "a.mcap").write_bytes(change(good(base)))
        return str(tmp_path / "a.mcap"), str(tmp_path / "good.mcap")

    return make


@pytest.mark.parametrize("row", ROWS)
def test_what_is_not_damaged_is_used(damaged, row):
    expected = ROWS[row][2]
    path, _ = damaged(row)
    if isinstance(expected, Refused):
        with pytest.raises(InputError) as caught:
            recording.read(path, OPTIONS)
        assert "a.mcap" in str(caught.value)
        assert [word for word in expected.words if word not in str(caught.value)] == []
    else:
        assert outcome(path) == (expected.stations, set(expected.codes))


@pytest.mark.parametrize(
    "row", [row for row in ROWS if row not in {"both-magics", "flipped-pixel"}]
)
def test_nothing_is_lost_silently_and_nothing_is_made_up(damaged, row):
    path, good_path = damaged(row)
    losses = Losses()
    try:
        found = told(path, losses)
    except InputError:
        return
    whole = told(good_path, Losses())
    made_up = found - whole - Counter({("/tf_static", 0): 1})
    assert not made_up
    assert found == whole or losses.places or losses.cut


@pytest.mark.parametrize("row", ROWS)
def test_who_looks_at_every_message_loses_the_same_of_those_wanted(damaged, row):
    path, _ = damaged(row)

    def scanned(*aside):
        losses = Losses()
        found = container.scan(path, lambda channel: channel.topic == IMAGE, losses, *aside)
        times = [each.log_time_ns for each in found if each.channel.topic == IMAGE]
        return times, losses

    try:
        alone = scanned()
    except InputError:
        return
    aside = Losses()
    assert scanned(aside) == alone
    assert not aside.cut


SCHEMAS = {
    "text-empty": ("cdr", "ros2msg", ""),
    "text-garbage": ("cdr", "ros2msg", "\x00\x01 !garbage"),
    "text-without-dependency": ("cdr", "ros2msg", "std_msgs/Header header\nno_such/Type x\n"),
    "of-a-service": ("cdr", "ros2msg", "int64 a\n---\nint64 sum\n"),
    "of-ros-idl": ("cdr", "ros2idl", f'{"=" * 80}\nIDL: x/msg/Y\n#include "x/msg/Z.idl"\n'),
    "of-another-kind": ("cdr", "omgidl", "module x {};"),
    "of-no-kind": ("cdr", "", ""),
}


@pytest.mark.parametrize("row", SCHEMAS)
def test_schemas_are_not_needed(tmp_path, messages, row):
    schemas = dict.fromkeys([TF, IMAGE, "/tf_static", "/camera/camera_info"], SCHEMAS[row])
    assert outcome(bags.write(tmp_path / "a.mcap", messages, schemas)) == (STATIONS, set())


def test_channels_that_are_not_known_are_in_nobodys_way(tmp_path, messages):
    other = [(bags.ns(t), "/notes", "notes", b"{}") for t in range(3)]
    messages = bags.in_order(messages, other)
    schemas = {"/notes": ("no-such-encoding", "no-such-kind", "x")}
    assert outcome(bags.write(tmp_path / "a.mcap", messages, schemas)) == (STATIONS, set())


PAYLOADS = {
    "empty": (TF, lambda data: b""),
    "short": (TF, lambda data: data[:-1]),
    "head-only": (TF, lambda data: data[:4]),
    "picture-empty": (IMAGE, lambda data: b""),
    "picture-short": (IMAGE, lambda data: data[:19]),
}


@pytest.mark.parametrize("row", PAYLOADS)
def test_a_message_that_cannot_be_read_costs_only_itself(tmp_path, messages, row):
    topic, change = PAYLOADS[row]
    messages = messages.copy()
    places = [index for index, each in enumerate(messages) if each[1] == topic]
    time, _, schema, data = messages[places[9]]
    messages[places[9]] = (time, topic, schema, change(data))
    read = recording.read(bags.write(tmp_path / "a.mcap", messages), OPTIONS)
    assert len(read.stations) == STATIONS
    (finding,) = [each for each in read.findings if each.code == UNREADABLE]
    assert finding.message.startswith(f"1 of {len(places)} messages of {topic} cannot be read: ")


def test_a_picture_with_fewer_pixels_than_it_says_costs_its_station(tmp_path, messages):
    """Pixels are not looked at before that, so it is the stage that looks at them which says so."""
    messages = messages.copy()
    places = [index for index, each in enumerate(messages) if each[1] == IMAGE]
    for index in places[-5:]:
        messages[index] = (*messages[index][:3], messages[index][3][:-100])
    *stations, last = recording.read(bags.write(tmp_path / "a.mcap", messages), OPTIONS).stations
    assert {station.image.load().shape for station in stations} == {bags.SIZE}
    with pytest.raises(InputError, match=r"found damage: .*3072.* 2972"):
        last.image.load()


def test_a_loss_is_told_in_bytes_and_messages(good, tmp_path):
    raw = good("plain")
    chunk = middle(raw)
    (tmp_path / "a.mcap").write_bytes(spoilt(raw, chunk))
    lost = sum(each.opcode == MESSAGE for each in inside(raw, chunk))
    (finding,) = [
        each
        for each in recording.read(str(tmp_path / "a.mcap"), OPTIONS).findings
        if each.code == DAMAGED
    ]
    assert f"in 1 place: {chunk.stop - chunk.offset} bytes and {lost} messages" in finding.message
    assert f"a.mcap, byte {chunk.offset}: a chunk with checksum" in finding.message


@pytest.mark.parametrize("checked", [False, True], ids=["no-crc", "crc"])
@pytest.mark.parametrize("by", [2**40, 7, -7])
def test_a_wrong_length_in_a_chunk_costs_the_rest_of_that_chunk_alone(good, tmp_path, by, checked):
    """Whether the chunk is read as a whole for its checksum, or record by record."""
    raw = good("no-crc")
    chunk = middle(raw)
    every = inside(raw, chunk)
    index = len(every) // 2
    path, losses = tmp_path / "a.mcap", Losses()
    path.write_bytes(raw)
    whole = told(str(path), losses)
    raw = longer(by)(raw, every[index])
    if checked:
        checksum = zlib.crc32(raw[data_of(raw, chunk) : chunk.stop])
        raw = number(raw, chunk.start + surgery.CHECKSUM_IN_CHUNK, checksum, "I")
    path.write_bytes(raw)
    found = told(str(path), losses)
    kept = index + (by < 2**40)  # only such a length cannot be that of a message
    behind = every[index].offset if by == 2**40 else every[index].stop + by
    assert (whole - found).total() == len(every) - kept
    assert (losses.places, losses.bytes) == (1, chunk.stop - behind)
    assert f"a.mcap, byte {chunk.offset}: " in losses.first


def test_a_cut_is_told_in_bytes(good, tmp_path):
    raw = good("plain")
    chunk = middle(raw)
    (tmp_path / "a.mcap").write_bytes(raw[: chunk.stop - 1])
    (finding,) = [
        each
        for each in recording.read(str(tmp_path / "a.mcap"), OPTIONS).findings
        if each.code == CUT
    ]
    assert f"without the last {chunk.stop - chunk.offset - 1} bytes" in finding.message


HUGE = 3 * 2**30
BOMBS = {
    "zstd": lambda: chunk_of(b"", "zstd", surgery.zstd_bomb(HUGE, told=True), size=HUGE),
    "zstd-said-small": lambda: chunk_of(b"", "zstd", surgery.zstd_bomb(HUGE, told=True), size=999),
    "zstd-untold": lambda: chunk_of(b"", "zstd", surgery.zstd_bomb(HUGE, told=False), size=999),
    "zstd-untold-and-huge": lambda: chunk_of(
        b"", "zstd", surgery.zstd_bomb(HUGE, told=False), size=2**40
    ),
    "lz4": lambda: chunk_of(b"", "lz4", surgery.lz4_bomb(HUGE), size=HUGE),
    "lz4-said-small": lambda: chunk_of(b"", "lz4", surgery.lz4_bomb(HUGE), size=999),
    "message": lambda: chunk_of(struct.pack("<BQ", MESSAGE, 2**62)),
    "schema": lambda: surgery.record(SCHEMA, struct.pack("<HI", 9, 2**32 - 1)),
    "channel": lambda: surgery.record(CHANNEL, struct.pack("<HHI", 9, 0, 2**32 - 1)),
}
IN_LITTLE_MEMORY = """
import json, resource, sys
from handeye_cli import recording
from handeye_cli.conventions import Setup
options = recording.McapOptions(setup=Setup.EYE_IN_HAND)
path, *paths = sys.argv[1:]
recording.read(path, options)  # loads all that is needed
pages = int(open("/proc/self/statm").read().split()[0])
limit = pages * resource.getpagesize() + 200_000_000
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
for path in paths:
    read = recording.read(path, options)
    codes = [each.code for each in read.findings]
    print(json.dumps([len(read.stations), "recording-damaged" in codes]))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited and measured as on Linux")
def test_memory_is_not_filled_by_a_few_bytes(good, tmp_path):
    """No chunk unpacks to 3 GB, whatever it says of itself, where 200 MB are left."""
    raw = good("bare")
    paths = [tmp_path / "good.mcap", *(tmp_path / f"{name}.mcap" for name in BOMBS)]
    paths[0].write_bytes(raw)
    for path, bomb in zip(paths[1:], BOMBS.values(), strict=True):
        path.write_bytes(inserted(raw, middle(raw).offset, bomb()))
    done = subprocess.run(
        [sys.executable, "-c", IN_LITTLE_MEMORY, *map(str, paths)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    found = dict(zip(BOMBS, map(json.loads, done.stdout.splitlines()), strict=True))
    assert found == {name: [STATIONS, True] for name in BOMBS}


def test_messages_of_a_channel_without_its_schema_are_counted(tmp_path):
    records_ = surgery.channel(1, 7, "/camera") + surgery.message(1) * 3
    (tmp_path / "a.mcap").write_bytes(ended(records_))
    losses = Losses()
    assert list(container.scan(str(tmp_path / "a.mcap"), lambda channel: True, losses)) == []
    assert losses.places == 4
    assert re.search(r"a.mcap, byte 25: '/camera' of schema 7, never declared", losses.first)


def test_declarations_do_not_fill_the_memory(tmp_path, monkeypatch):
    monkeypatch.setattr("handeye_cli.recording.channels._MAX_BYTES", 10_000)
    many = b"".join(surgery.schema(number, "a/B", data=bytes(900)) for number in range(1, 30))
    (tmp_path / "a.mcap").write_bytes(ended(many))
    losses = Losses()
    assert list(container.scan(str(tmp_path / "a.mcap"), lambda channel: True, losses)) == []
    assert "more than 10000 bytes of schemas and channels" in losses.first


def test_a_head_that_cannot_be_read_is_damage_where_it_stands():
    """Or what comes behind it would be sought from the beginning of the file, again and again."""

    class Broken:
        size = 100

        def unpack(self, form, start):
            raise framing.DamageError("bytes that cannot be read")

    with pytest.raises(framing.DamageError) as caught:
        list(framing.records(Broken(), 40, 100))
    assert caught.value.offset == 40


def test_a_disk_that_fails_is_damage(good, tmp_path, monkeypatch):
    (tmp_path / "a.mcap").write_bytes(good("no-crc"))
    read = framing.FileBytes.read

    class Failing:
        def __init__(self, stream):
            self.stream = stream

        def seek(self, *args):
            return self.stream.seek(*args)

        def read(self, size):
            if 100_000 < self.stream.tell() < 101_000:
                raise OSError(5, "Input/output error")
            return self.stream.read(size)

    def failing(self, start, stop):
        if not isinstance(self._stream, Failing):
            self._stream = Failing(self._stream)
        return read(self, start, stop)

    monkeypatch.setattr(framing.FileBytes, "read", failing)
    losses = Losses()
    told(str(tmp_path / "a.mcap"), losses)
    assert "Input/output error" in losses.first
