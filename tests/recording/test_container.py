"""The container: all layouts give the same messages, and damage is named."""

import struct
from itertools import pairwise
from pathlib import Path

import pytest
import zstandard
from mcap.reader import NonSeekingReader
from recording.bags import LAYOUTS, Robot, write

from handeye_cli.errors import InputError
from handeye_cli.recording import container

MESSAGES = Robot(stations=2, rate=20.0).messages()


@pytest.fixture(params=LAYOUTS)
def layout(request):
    return LAYOUTS[request.param]


def everything(path):
    return [(m.channel.topic, m.log_time_ns, m.data) for m in container.scan(path, lambda _: True)]


def reference(path):
    with Path(path).open("rb") as file:
        return [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in NonSeekingReader(file).iter_messages(log_time_order=False)
        ]


def test_scan_gives_what_the_reference_reader_gives(tmp_path, layout):
    path = write(tmp_path / "a.mcap", MESSAGES, **layout)
    assert everything(path) == reference(path)
    assert len(everything(path)) == len(MESSAGES)
    assert not container.is_cut(path)


def test_only_wanted_channels_are_given_and_each_is_asked_for_once(tmp_path, layout):
    path = write(tmp_path / "a.mcap", MESSAGES, **layout)
    asked = []

    def wanted(channel):
        asked.append(channel.topic)
        return channel.topic == "/tf"

    assert {m.channel.topic for m in container.scan(path, wanted)} == {"/tf"}
    assert sorted(asked) == ["/camera/camera_info", "/camera/image_raw", "/tf", "/tf_static"]


def test_payloads_are_found_again_by_their_positions(tmp_path, layout):
    path = write(tmp_path / "a.mcap", MESSAGES, **layout)
    chosen = list(container.scan(path, lambda channel: "image" in channel.topic))[::-7]
    found = container.read_payloads(path, [message.position for message in chosen])
    assert list(found) == [message.data for message in chosen]


def test_cut_file_gives_what_comes_before_the_cut(tmp_path, layout):
    path = write(tmp_path / "a.mcap", MESSAGES, **{**layout, "chunk_size": 4000})
    whole = everything(path)
    raw = (tmp_path / "a.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    counts = []
    for eighth in range(1, 8):
        cut.write_bytes(raw[: len(raw) * eighth // 8])
        found = everything(str(cut))
        assert found == whole[: len(found)]
        assert container.is_cut(str(cut))
        counts.append(len(found))
    assert all(few <= many for few, many in pairwise(counts))
    assert counts[3] > 0.25 * len(whole)


def test_cut_inside_any_part_of_a_record_is_only_a_cut(tmp_path):
    path = write(tmp_path / "a.mcap", MESSAGES[:6], use_chunking=False)
    raw = (tmp_path / "a.mcap").read_bytes()
    for length in range(8, len(raw), 11):
        (tmp_path / "cut.mcap").write_bytes(raw[:length])
        found = everything(str(tmp_path / "cut.mcap"))
        assert found == everything(path)[: len(found)]


def test_zeros_after_a_cut_are_not_read(tmp_path):
    path = write(tmp_path / "a.mcap", MESSAGES, use_chunking=False)
    raw = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(raw[: len(raw) // 2] + bytes(len(raw) // 2))
    found = everything(str(tmp_path / "cut.mcap"))
    assert len(found) > len(MESSAGES) // 4
    # the message the zeros begin in cannot be told from a whole one
    assert found[:-1] == everything(path)[: len(found) - 1]


@pytest.mark.parametrize(
    ("content", "found", "hint"),
    [
        (b"", "an empty file", None),
        (b"\x89MC", "starts with", None),
        (b"\x89PNG\r\n\x1a\n", "PNG", None),
        (b"#ROSBAG V2.0\n", "#ROSBAG", "mcap convert"),
        (b"SQLite format 3\0", "SQLite", "ros2 bag convert"),
        (zstandard.compress(b"\x89MCAP0\r\n"), "starts with", "zstd -d"),
    ],
)
def test_what_is_no_mcap_is_named(tmp_path, content, found, hint):
    (tmp_path / "a.mcap").write_bytes(content)
    with pytest.raises(InputError, match=found) as caught:
        everything(str(tmp_path / "a.mcap"))
    assert caught.value.where.endswith("a.mcap")
    assert hint is None or hint in caught.value.hint


@pytest.mark.parametrize("name", ["missing.mcap", "."])
def test_what_cannot_be_opened_is_named(tmp_path, name):
    with pytest.raises(InputError, match=r"cannot read it: (No such file|Is a directory)"):
        everything(str(tmp_path / name))


def flipped(raw, offset):
    return raw[:offset] + bytes([raw[offset] ^ 0x55]) + raw[offset + 1 :]


@pytest.mark.parametrize("name", ["zstd", "lz4", "plain"])
def test_flipped_byte_in_a_chunk_is_named(tmp_path, name):
    path = write(tmp_path / "a.mcap", MESSAGES, **LAYOUTS[name])
    raw = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "a.mcap").write_bytes(flipped(raw, len(raw) // 3))
    with pytest.raises(InputError, match="found damage") as caught:
        everything(path)
    assert "a.mcap, byte " in caught.value.where
    assert "mcap recover" in caught.value.hint


def first_chunk(raw):
    """Return where the chunk record, and its compression's name, start."""
    offset = 8
    while raw[offset] != 6:
        offset += 9 + struct.unpack_from("<Q", raw, offset + 1)[0]
    return offset, offset + 9 + 8 + 8 + 8 + 4


@pytest.mark.parametrize(
    ("change", "found"),
    [
        (lambda raw, chunk, name: raw[: name + 4] + b"gzip" + raw[name + 8 :], "'gzip'"),
        (
            lambda raw, chunk, name: raw[: chunk + 25] + struct.pack("<Q", 2**40) + raw[name - 4 :],
            str(2**40),
        ),
        (
            lambda raw, chunk, name: raw[: chunk + 1] + struct.pack("<Q", 2**62) + raw[chunk + 9 :],
            str(2**62),
        ),
        (lambda raw, chunk, name: raw[:chunk] + b"\0" + raw[chunk + 1 :], "opcode 0"),
    ],
    ids=["compression", "unpacked size", "record length", "opcode"],
)
def test_damaged_chunk_is_named(tmp_path, change, found):
    path = write(tmp_path / "a.mcap", MESSAGES)
    raw = (tmp_path / "a.mcap").read_bytes()
    chunk, name = first_chunk(raw)
    (tmp_path / "a.mcap").write_bytes(change(raw, chunk, name))
    with pytest.raises(InputError, match=found) as caught:
        everything(path)
    assert caught.value.where == f"{path}, byte {chunk}"


def test_damaged_length_inside_a_chunk_loses_nothing_silently(tmp_path):
    path = write(tmp_path / "a.mcap", MESSAGES, **LAYOUTS["no-crc"])
    raw = bytearray((tmp_path / "a.mcap").read_bytes())
    topics = {"/tf"}
    message = next(m for m in container.scan(path, lambda c: c.topic in topics))
    content_start = first_chunk(raw)[1] + 4 + 8
    raw[content_start + message.position.start - 22 - 8 + 4] = 0xFF
    (tmp_path / "a.mcap").write_bytes(raw)
    with pytest.raises(InputError, match=r"a record of .* bytes in a chunk of"):
        everything(path)


def test_positions_of_another_file_are_refused(tmp_path):
    path = write(tmp_path / "a.mcap", MESSAGES)
    position = container.Position(10**9, 0, 10)
    with pytest.raises(InputError, match="found damage"):
        list(container.read_payloads(path, [position]))
    chunk = first_chunk((tmp_path / "a.mcap").read_bytes())[0]
    with pytest.raises(InputError, match="found damage"):
        list(container.read_payloads(path, [container.Position(chunk, 0, 10**9)]))


def test_memory_does_not_grow_with_the_file(tmp_path):
    import tracemalloc

    peaks = []
    for count in (20, 200):
        big = [(t, "/big", "sensor_msgs/Image", bytes(50_000)) for t in range(count)]
        path = write(tmp_path / "big.mcap", big, chunk_size=100_000)
        tracemalloc.start()
        assert sum(1 for _ in container.scan(path, lambda _: True)) == count
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.5 * peaks[0]


def record(opcode, content):
    return struct.pack("<BQ", opcode, len(content)) + content


def chunk_of(records):
    return record(6, struct.pack("<QQQIIQ", 0, 0, len(records), 0, 0, len(records)) + records)


@pytest.mark.parametrize(
    ("records", "found"),
    [
        (record(5, struct.pack("<HIQQ", 9, 0, 1, 1) + b"x"), "a message of channel 9"),
        (record(5, b"short"), "requires a buffer of"),
        (chunk_of(record(5, b"short") + record(99, bytes(30))), "requires a buffer of"),
        (record(4, struct.pack("<HH", 1, 7) + bytes(12)), "7"),
        (record(3, struct.pack("<HI", 1, 10**9)), "EndOfFile"),
        (record(6, b""), "EndOfFile"),
    ],
    ids=[
        "undeclared channel",
        "message head",
        "message head in a chunk",
        "missing schema",
        "schema text",
        "empty chunk",
    ],
)
def test_damaged_record_is_named(tmp_path, records, found):
    end = record(15, bytes(4)) + record(2, bytes(20)) + container.MAGIC
    (tmp_path / "a.mcap").write_bytes(container.MAGIC + record(1, bytes(8)) + records + end)
    with pytest.raises(InputError, match=found) as caught:
        everything(str(tmp_path / "a.mcap"))
    assert caught.value.where.endswith("a.mcap, byte 25")
