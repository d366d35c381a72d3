"""The container: all layouts give the same messages, and damage is named."""

import os
import tracemalloc
from collections import Counter
from io import BytesIO
from itertools import pairwise
from pathlib import Path

import pytest
import zstandard
from hypothesis import example, given, settings
from hypothesis import strategies as st
from mcap.reader import NonSeekingReader
from mcap.writer import CompressionType, IndexType, Writer
from recording.bags import LAYOUTS, Robot, write
from recording.surgery import (
    CHUNK,
    CHUNK_INDEX,
    flipped,
    middle,
    of_kind,
    put,
    signed,
    summary_start,
)

from handeye_cli.errors import InputError
from handeye_cli.recording import chunks, container, framing
from handeye_cli.recording.losses import Losses

MESSAGES = Robot(stations=2, rate=20.0).messages()


@pytest.fixture(params=LAYOUTS)
def layout(request):
    return LAYOUTS[request.param]


def everything(path, losses=None):
    found = container.scan(path, lambda _: True, losses or Losses())
    return [(message.channel.topic, message.log_time_ns, message.data) for message in found]


def reference(path):
    with Path(path).open("rb") as file:
        return [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in NonSeekingReader(file).iter_messages(log_time_order=False)
        ]


def is_cut(path):
    losses = Losses()
    everything(path, losses)
    return losses.cut == 1


def test_scan_gives_what_the_reference_reader_gives(tmp_path, layout):
    path = write(tmp_path / "a.mcap", MESSAGES, **layout)
    assert everything(path) == reference(path)
    assert len(everything(path)) == len(MESSAGES)
    assert not is_cut(path)


def test_only_wanted_channels_are_given_and_each_is_asked_for_once(tmp_path, layout):
    path = write(tmp_path / "a.mcap", MESSAGES, **layout)
    asked = []

    def wanted(channel):
        asked.append(channel.topic)
        return channel.topic == "/tf"

    assert {m.channel.topic for m in container.scan(path, wanted, Losses())} == {"/tf"}
    assert sorted(asked) == ["/camera/camera_info", "/camera/image_raw", "/tf", "/tf_static"]


def test_payloads_are_found_again_by_their_positions(tmp_path, layout):
    path = write(tmp_path / "a.mcap", MESSAGES, **layout)
    found = list(container.scan(path, lambda channel: "image" in channel.topic, Losses()))[::-7]
    payloads = [data for topic, _, data in reference(path) if "image" in topic][::-7]
    assert list(container.read_payloads([each.position for each in found])) == payloads


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
        assert is_cut(str(cut))
        counts.append(len(found))
    assert all(few <= many for few, many in pairwise(counts))
    assert counts[3] > 0.25 * len(whole)


def test_cut_inside_any_part_of_a_record_is_only_a_cut(tmp_path):
    path = write(tmp_path / "a.mcap", MESSAGES[:6], use_chunking=False)
    whole, size = everything(path), Path(path).stat().st_size
    for length in reversed(range(8, size, 11)):
        os.truncate(path, length)
        losses = Losses()
        found = everything(path, losses)
        assert found == whole[: len(found)]
        assert (losses.cut, losses.places) == (1, 0)


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


def test_positions_of_another_file_are_refused(tmp_path):
    path = write(tmp_path / "a.mcap", MESSAGES)
    chunk = of_kind(Path(path).read_bytes(), CHUNK)[0].offset
    for place in [(10**9, 0, 10), (None, 10**9, 10**9 + 1), (chunk, 0, 10**9), (8, 0, 10)]:
        with pytest.raises(InputError, match="found damage"):
            list(container.read_payloads([container.Position(path, *place)]))


@pytest.mark.parametrize("enable_crcs", [False, True], ids=["no-crc", "crc"])
def test_damage_to_a_picture_is_told_where_it_stands(tmp_path, enable_crcs):
    options = {"compression": CompressionType.NONE, "enable_crcs": enable_crcs}
    path = write(tmp_path / "a.mcap", MESSAGES, **options)
    *_, last = container.scan(path, lambda channel: True, Losses())
    os.truncate(path, last.position.stop - 1)
    with pytest.raises(InputError, match="found damage: ") as caught:
        list(container.read_payloads([last.position]))
    assert last.position.start > 1000
    assert caught.value.where == f"{path}, byte {last.position.start}"


def test_memory_does_not_grow_with_the_file(tmp_path):
    peaks = []
    for count in (20, 200):
        big = [(t, "/big", "sensor_msgs/Image", bytes(50_000)) for t in range(count)]
        path = write(tmp_path / "big.mcap", big, chunk_size=100_000)
        tracemalloc.start()
        assert sum(1 for _ in container.scan(path, lambda _: True, Losses())) == count
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.5 * peaks[0]


SMALL = st.tuples(st.integers(0, 3), st.integers(0, 2**63), st.binary(max_size=60))


@given(
    messages=st.lists(SMALL, max_size=30),
    extras=st.lists(st.integers(0, 30), max_size=3),
    options=st.fixed_dictionaries(
        {
            "compression": st.sampled_from(CompressionType),
            "index_types": st.sampled_from([*IndexType, IndexType.NONE, IndexType.ALL]),
            "chunk_size": st.sampled_from([1, 50, 400, 10**6]),
        }
        | {
            name: st.booleans()
            for name in (
                "repeat_channels", "repeat_schemas", "use_chunking", "use_statistics",
                "use_summary_offsets", "enable_crcs", "enable_data_crcs",
            )
        }
    ),
)  # fmt: skip
@example(  # the schema stands in the chunk of a channel that has none
    messages=[(0, 0, b""), (1, 0, b"")],
    extras=[],
    options={"compression": CompressionType.NONE, "chunk_size": 1, "repeat_schemas": False},
)
@settings(max_examples=150, deadline=None)
def test_every_layout_of_the_official_writer_is_read_as_by_the_official_reader(
    tmp_path_factory, messages, extras, options
):
    path = tmp_path_factory.mktemp("layout") / "a.mcap"
    file = BytesIO()
    writer = Writer(file, **options)
    writer.start()
    schema = writer.register_schema("a/B", "ros2msg", b"uint8 x")
    channels = {}
    for index, (number, time, payload) in enumerate(messages):
        if index in extras:
            writer.add_metadata("name", {"key": "value"})
            writer.add_attachment(1, 2, "file", "text/plain", b"text")
        if number not in channels:
            channels[number] = writer.register_channel(f"/{number}", "x", schema * (number > 0))
        writer.add_message(channels[number], time, payload, time)
    writer.finish()
    path.write_bytes(file.getvalue())
    losses = Losses()
    assert everything(str(path), losses) == reference(path)
    assert losses == Losses()
    wanted = Counter(each for each in reference(path) if each[0] == "/1")
    found = container.scan(str(path), lambda channel: channel.topic == "/1", losses)
    assert Counter((m.channel.topic, m.log_time_ns, m.data) for m in found) == wanted
    assert losses == Losses()


@pytest.fixture
def bytes_read(monkeypatch):
    """Count what is read out of files."""
    read, count = framing.FileBytes.read, []

    def counting(self, start, stop):
        count.append(stop - start)
        return read(self, start, stop)

    monkeypatch.setattr(framing.FileBytes, "read", counting)
    return lambda: sum(count)


@pytest.mark.parametrize("most_held", [0, 10**6])
def test_chunks_are_checked_whether_they_are_held_or_not(tmp_path, monkeypatch, most_held):
    monkeypatch.setattr(chunks, "_MOST_HELD", most_held)
    monkeypatch.setattr(chunks, "_BLOCK", 999)
    path = write(tmp_path / "a.mcap", MESSAGES, compression=CompressionType.NONE, chunk_size=9000)
    assert everything(path) == reference(path)
    raw = Path(path).read_bytes()
    chunk = middle(raw)
    Path(path).write_bytes(flipped(raw, chunk.stop - 1))
    losses = Losses()
    assert 0 < len(everything(path, losses)) < len(MESSAGES)
    assert (losses.places, losses.bytes) == (1, chunk.stop - chunk.offset)
    assert f"byte {chunk.offset}: a chunk with checksum" in losses.first


@pytest.mark.parametrize("name", ["no-chunks", "no-crc"])
def test_payloads_that_nobody_asks_for_are_not_read(tmp_path, bytes_read, name):
    big = [(t, "/big", "sensor_msgs/Image", bytes(50_000)) for t in range(50)]
    path = write(tmp_path / "a.mcap", big, chunk_size=100_000, **LAYOUTS[name])
    messages = list(container.scan(path, lambda _: True, Losses()))
    assert len(messages) == 50
    assert bytes_read() < 20_000


def mixed(path, **options):
    """Write a few messages of use among large ones of a topic that is of none."""
    big = [(t, "/cloud", "sensor_msgs/PointCloud2", bytes(5_000)) for t in range(100)]
    small = [(t + 0.5, "/tf", "tf2_msgs/msg/TFMessage", bytes([t])) for t in range(0, 100, 25)]
    messages = sorted(big + small, key=lambda message: message[0])
    return write(path, [(int(t), *rest) for t, *rest in messages], chunk_size=9_000, **options)


def transforms(path, losses=None):
    found = container.scan(path, lambda channel: channel.topic == "/tf", losses or Losses())
    return [message.data for message in found]


@pytest.mark.parametrize(("name", "looked_into"), [("zstd", 4), ("plain", 4), ("no-index", 50)])
def test_chunks_without_a_message_of_use_are_passed_over(tmp_path, monkeypatch, name, looked_into):
    offsets = []

    def content_of(file, chunk):
        offsets.append(chunk.offset)
        return real(file, chunk)

    real = container.content_of
    monkeypatch.setattr(container, "content_of", content_of)
    path = mixed(tmp_path / "a.mcap", **LAYOUTS[name])
    assert transforms(path) == [bytes([t]) for t in range(0, 100, 25)]
    assert len(offsets) == looked_into


def test_an_index_that_hides_messages_is_found_out(tmp_path):
    """It says of every chunk that it holds only what is of no use; the counts say otherwise."""
    path = mixed(tmp_path / "a.mcap", **LAYOUTS["plain"])
    raw = Path(path).read_bytes()
    start = summary_start(raw)
    for index in of_kind(raw, CHUNK_INDEX):
        for offset in range(index.start + 36, index.stop - 28, 10):
            raw = put(raw, offset, b"\1\0")
    Path(path).write_bytes(signed(raw, start))
    losses = Losses()
    assert transforms(path, losses) == []
    assert losses.messages == 4
    assert "0 messages of /tf, of which it counts 4" in losses.first


def test_damage_to_what_nobody_wants_is_counted_apart(tmp_path):
    """Whoever asks for the wanted messages alone does not even see it."""
    path = mixed(tmp_path / "a.mcap", **LAYOUTS["plain"])
    losses, aside = Losses(), Losses()
    idle, used = (of_kind(Path(path).read_bytes(), CHUNK)[index] for index in (2, 0))
    Path(path).write_bytes(flipped(Path(path).read_bytes(), idle.stop - 1))
    wanted = transforms(path, losses)
    assert len(wanted) == 4
    assert losses == Losses()
    every = list(container.scan(path, lambda channel: channel.topic == "/tf", losses, aside))
    assert Counter(each.channel.topic for each in every) == {"/tf": 4, "/cloud": 98}
    assert losses == Losses()
    assert (aside.places, aside.messages) == (1, 2)
    assert f"byte {idle.offset}: a chunk with checksum" in aside.first

    Path(path).write_bytes(flipped(Path(path).read_bytes(), used.stop - 1))
    assert len(transforms(path, losses)) == 3
    alike = Losses()
    assert list(container.scan(path, lambda channel: channel.topic == "/tf", alike, aside))
    assert alike == losses
    assert losses.places == losses.messages == 1
