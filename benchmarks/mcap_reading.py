"""Time, bytes and memory of reading an MCAP recording, beside the plain official reader.

A robot with a camera is written into a temporary folder: pictures at 5 Hz, at rest and in motion,
transforms at 100 Hz. Each reading is a process of its own, so that its peak of memory is its own:

    stations  `recording.read`, which finds the pauses
    pictures  the same, then the pictures of all pauses
    records   every record is read and unpacked, and nothing else is done
    official  every message of the same topics out of the reader of the package `mcap`

The peak must not grow with the recording, and `stations` must take at most 1.5 times as long as
`records` where both need the whole file. Prints a table:

    python benchmarks/mcap_reading.py --gigabytes 1 --layouts zstd,chunks,no-crc,unchunked
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from mcap.writer import CompressionType, Writer

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


@dataclass(frozen=True)
class Cost:
    """What one reading took: things counted, seconds, and bytes read and at most in memory."""

    count: int
    clock: float
    processor: float
    read: float
    peak: float


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
                tool = TransformStamped(
                    Header(stamp, "base"), "tool", place(t), (0.0, 0.0, 0.0, 1.0)
                )
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


def bytes_read() -> float:
    """Return how many bytes this process has read from files; not a number where nobody counts."""
    try:
        counters = Path("/proc/self/io").read_text(encoding="ascii").split()
    except OSError:
        return float("nan")
    return float(counters[counters.index("rchar:") + 1])


def run(name: str, path: str) -> Cost:
    read, clock, processor = bytes_read(), time.perf_counter(), time.process_time()
    count = READINGS[name](path)
    scale = 1 if sys.platform == "darwin" else 1024
    return Cost(
        count,
        time.perf_counter() - clock,
        time.process_time() - processor,
        bytes_read() - read,
        resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * scale,
    )


def report(layout: str, size: int, name: str, cost: Cost) -> str:
    return (
        f"{layout:10s} {size / MB:8.0f} {name:9s} {cost.count:8d} {cost.clock:8.2f} "
        f"{cost.processor:8.2f} {cost.read / MB:9.1f} {cost.peak / MB:8.0f}"
    )


def words(text: str) -> list[str]:
    return text.split(",")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--gigabytes", type=float, default=1.0, help="before packing; 5 is telling")
    parser.add_argument("--layouts", type=words, default=list(LAYOUTS), help=",".join(LAYOUTS))
    parser.add_argument("--readings", type=words, default=list(READINGS), help=",".join(READINGS))
    parser.add_argument("--folder", help="for the recordings, which are deleted in the end")
    options = parser.parse_args()
    print("layout      file MB reading      count  clock s  proc. s   read MB  peak MB")
    # a process starts with the peak of the one that starts it, so this one does nothing itself
    processes = ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1)
    with tempfile.TemporaryDirectory(dir=options.folder) as folder, processes:
        for layout in options.layouts:
            path = Path(folder) / "recording.mcap"
            processes.submit(write, path, options.gigabytes * 1e9, LAYOUTS[layout]).result()
            for name in options.readings:
                cost = processes.submit(run, name, str(path)).result()
                print(report(layout, path.stat().st_size, name, cost), flush=True)


if __name__ == "__main__":
    main()
