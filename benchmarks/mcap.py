"""Time, bytes and memory of reading an MCAP recording, beside the plain official reader."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from mcap.writer import CompressionType, Writer

from benchmarks.effort import Effort
from benchmarks.processes import Cost, alone
from benchmarks.tables import Column, Table
from handeye_cli import recording
from handeye_cli.conventions import Setup
from handeye_cli.recording.cdr_writing import encoded
from handeye_cli.recording.messages import (
    Header,
    ImageMessage,
    TransformsMessage,
    TransformStamped,
)

LAYOUTS = {
    "zstd": {"compression": CompressionType.ZSTD},
    "lz4": {"compression": CompressionType.LZ4},
    "chunks": {"compression": CompressionType.NONE},
    "no-crc": {"compression": CompressionType.NONE, "enable_crcs": False},
    "unchunked": {"use_chunking": False},
}
SIZE = (1024, 1280)
STILL = (0.0, 0.0, 0.0, 1.0)
SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
PERIOD, PAUSE = 3.0, 2.0
"""Seconds from station to station, and of the pause at each."""
TRANSFORMS_PER_PICTURE = 20
TOPICS = {"/tf": "tf2_msgs/msg/TFMessage", "/camera/image_raw": "sensor_msgs/msg/Image"}
MB = 1e6


HEADS = (
    Column("layout"),
    Column("file [MB]", ".0f"),
    Column("reading"),
    Column("count", "d"),
    Column("clock [s]", ".2f"),
    Column("processor [s]", ".2f"),
    Column("of records", ".2f"),
    Column("read [MB]", ".1f"),
    Column("peak [MB]", ".0f"),
)
NOTE = """A robot with a camera: pictures at 5 Hz, at rest and in motion, transforms at 100 Hz.
`stations` finds the pauses, `pictures` loads the pictures of all pauses too, `records` reads and
unpacks every record and does nothing else, `official` takes every message of the same topics out
of the reader of the package `mcap`. The peak must not grow with the recording, and `stations`
must take at most 1.5 times as long as `records` where both need the whole file."""


def pictures() -> list[bytes]:
    """Return a few pictures with the noise of a sensor, which compresses badly."""
    rng = np.random.default_rng(0)
    smooth = 128 + 80 * np.sin(np.arange(SIZE[1]) / 90) * np.cos(np.arange(SIZE[0]) / 70)[:, None]
    noisy = [smooth + rng.normal(0.0, 2.0, SIZE) for _ in range(4)]
    return [np.clip(each, 0, 255).astype(np.uint8).tobytes() for each in noisy]


def place(t: float) -> tuple[float, float, float]:
    """Return where the robot's tool is: at rest on a circle, or on the way to the next place."""
    station, since = divmod(t, PERIOD)
    s = np.clip((since - PAUSE) / (PERIOD - PAUSE), 0.0, 1.0)
    angle = 0.7 * (station + s**3 * (10 - 15 * s + 6 * s**2))
    return 0.5 * np.cos(angle), 0.5 * np.sin(angle), 0.3


def write(path: Path, size: float, options: dict) -> None:
    """Write a recording of about this many bytes, before they are packed."""
    height, width = SIZE
    shown = pictures()
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start(profile="ros2", library="handeye benchmark")
        channel = {
            topic: writer.register_channel(topic, "cdr", writer.register_schema(name, "", b""))
            for topic, name in TOPICS.items()
        }
        for k in range(round(size / (height * width))):
            for i in range(TRANSFORMS_PER_PICTURE):
                t = 0.2 * k + 0.01 * i
                stamp = START + round(t * SECOND)
                tool = TransformStamped(Header(stamp, "base"), "tool", place(t), STILL)
                payload = encoded(TransformsMessage((tool,)))
                writer.add_message(channel["/tf"], stamp, payload, stamp)
            header = Header(stamp, "camera")
            image = ImageMessage(header, height, width, "mono8", False, width, shown[k % 4])
            writer.add_message(channel["/camera/image_raw"], stamp, encoded(image), stamp)
        writer.finish()


def stations(path: str) -> int:
    options = recording.McapOptions(setup=Setup.EYE_IN_HAND)
    return len(recording.read(path, options).stations)


def station_pictures(path: str) -> int:
    options = recording.McapOptions(setup=Setup.EYE_IN_HAND)
    return sum(station.image.load().size > 0 for station in recording.read(path, options).stations)


def records(path: str) -> int:
    with Path(path).open("rb") as file:
        count = 0
        for record in StreamReader(file, emit_chunks=True).records:
            if isinstance(record, Chunk):
                get_chunk_data_stream(record, validate_crc=True)
            count += 1
    return count


def official(path: str) -> int:
    with Path(path).open("rb") as file:
        summary = make_reader(file).get_summary()
        file.seek(0)
        # either order of the two would hold the whole of the other kind of file in memory
        if summary is not None and summary.chunk_indexes:
            messages = make_reader(file, validate_crcs=True).iter_messages(list(TOPICS))
        else:
            messages = NonSeekingReader(file).iter_messages(list(TOPICS), log_time_order=False)
        return sum(1 for _ in messages)


READINGS = {
    "stations": stations,
    "pictures": station_pictures,
    "records": records,
    "official": official,
}


def row(layout: str, size: int, name: str, cost: Cost, least: Cost):
    taken = (cost.clock, cost.processor, cost.processor / least.processor)
    return (layout, size / MB, name, cost.result, *taken, cost.read / MB, cost.peak / MB)


def tables(effort: Effort) -> Iterator[Table]:
    rows = []
    with tempfile.TemporaryDirectory(dir=effort.folder or None) as folder:
        for layout in effort.layouts.split(","):
            path = Path(folder) / "recording.mcap"
            alone(write, path, effort.gigabytes * 1e9, LAYOUTS[layout])
            costs = {name: alone(reading, str(path)) for name, reading in READINGS.items()}
            size = path.stat().st_size
            rows += [row(layout, size, *each, costs["records"]) for each in costs.items()]
    title = f"Reading a recording of {effort.gigabytes:g} GB before packing"
    yield Table("mcap_reading", title, HEADS, rows, NOTE)
