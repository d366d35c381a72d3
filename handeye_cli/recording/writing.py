"""A robot's recording into an MCAP file, as ROS 2 would have recorded it; the inverse of reading.

The messages come from several streams, each in the order of its own times, and are merged while
they are written: no more than one picture is in memory at a time, apart from the open chunk.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import IO

from mcap.writer import CompressionType, Writer

from handeye_cli import __version__
from handeye_cli.images import encode_png
from handeye_cli.recording.cdr_writing import AnyWritten, encoded
from handeye_cli.recording.message_table import SCHEMAS
from handeye_cli.recording.messages import (
    CameraInfoMessage,
    CompressedImageMessage,
    Header,
    ImageMessage,
    TransformsMessage,
    TransformStamped,
)
from handeye_cli.recording.transforms import Samples
from handeye_cli.records import Camera, GreyImage

IMAGE_TOPIC = "/camera/image_raw"
CAMERA_INFO_TOPIC = "/camera/camera_info"
CAMERA_FRAME = "camera_optical_frame"
IMAGE_DELAY_NS = 30_000_000
"""From a picture's stamp to the time at which it is recorded."""

_CHUNK_BYTES = 2**20
_TIME = f"{'=' * 80}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
"""The one definition that our decoders have built in and that other tools may miss."""
_FOREVER = "\n    sec: 9223372036\n    nsec: 854775807"
_QUALITY = (
    "- history: 1\n  depth: 10\n  reliability: 1\n  durability: {durability}\n"
    f"  deadline:{_FOREVER}\n  lifespan:{_FOREVER}\n"
    f"  liveliness: 1\n  liveliness_lease_duration:{_FOREVER}\n"
    "  avoid_ros_namespace_conventions: false\n"
)
"""A topic's quality of service in the words and numbers of rosbag2, which reads it for playing."""
_VOLATILE, _TRANSIENT_LOCAL = 2, 1
_STATIC_TOPIC = "/tf_static"
_SCHEMA_OF = {
    ImageMessage: "sensor_msgs/msg/Image",
    CompressedImageMessage: "sensor_msgs/msg/CompressedImage",
    CameraInfoMessage: "sensor_msgs/msg/CameraInfo",
    TransformsMessage: "tf2_msgs/msg/TFMessage",
}


@dataclass(frozen=True)
class Streams:
    """What there is to record.

    Attributes:
        camera: Intrinsics, sent with every picture.
        pictures: Stamps in nanoseconds, rising, and pictures; looked at once.
        links: The robot's transforms, each link's in order of time.
        compressed: Whether pictures are recorded as PNG files, else pixel by pixel.
        notes: Written into the file beside the messages, for people.
    """

    camera: Camera
    pictures: Iterable[tuple[int, GreyImage]]
    links: Sequence[Samples]
    compressed: bool = True
    notes: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class _Sent:
    """A message on its way into the file."""

    log_time_ns: int
    topic: str
    message: AnyWritten


def write(file: IO[bytes], streams: Streams) -> None:
    """Write a recording; the same bytes for the same streams.

    Args:
        file: An open binary file.
        streams: What there is to record.
    """
    writer = Writer(file, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD)
    writer.start(profile="ros2", library=f"handeye {__version__}")
    channels = _Channels(writer)
    links = [_transforms(link) for link in streams.links]
    for sent in heapq.merge(*links, _camera(streams), key=lambda sent: sent.log_time_ns):
        channels.write(sent)
    if streams.notes:
        writer.add_metadata("handeye", dict(streams.notes))
    writer.finish()  # type: ignore[no-untyped-call]


class _Channels:
    """The topics of a file, made with the first message of each."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._counts: dict[str, int] = {}

    def write(self, sent: _Sent) -> None:
        if sent.topic not in self._channels:
            self._channels[sent.topic] = self._register(sent)
        count = self._counts[sent.topic] = self._counts.get(sent.topic, -1) + 1
        channel, time = self._channels[sent.topic], sent.log_time_ns
        payload = encoded(sent.message)
        self._writer.add_message(channel, time, payload, publish_time=time, sequence=count)

    def _register(self, sent: _Sent) -> int:
        name = _SCHEMA_OF[type(sent.message)]
        if name not in self._schemas:
            module = import_module(SCHEMAS[name.replace("/msg/", "/")].module)
            text = module.DEFINITION + _TIME
            self._schemas[name] = self._writer.register_schema(name, "ros2msg", text.encode())
        durability = _TRANSIENT_LOCAL if sent.topic == _STATIC_TOPIC else _VOLATILE
        quality = {"offered_qos_profiles": _QUALITY.format(durability=durability)}
        return self._writer.register_channel(sent.topic, "cdr", self._schemas[name], quality)


def _transforms(link: Samples) -> Iterator[_Sent]:
    topic = _STATIC_TOPIC if link.static else "/tf"
    for stamp, log_time, numbers in zip(
        link.stamps_ns.tolist(), link.log_times_ns.tolist(), link.numbers.tolist(), strict=True
    ):
        x, y, z, *quaternion = numbers
        header = Header(stamp, link.parent)
        transform = TransformStamped(header, link.child, (x, y, z), tuple(quaternion))
        yield _Sent(log_time, topic, TransformsMessage((transform,)))


def _camera(streams: Streams) -> Iterator[_Sent]:
    """Yield the intrinsics and the picture of each stamp, as one stream draws each only once."""
    for stamp, picture in streams.pictures:
        header, time = Header(stamp, CAMERA_FRAME), stamp + IMAGE_DELAY_NS
        yield _Sent(time, CAMERA_INFO_TOPIC, _camera_info(header, streams.camera))
        yield _picture(header, time, picture, streams.compressed)


def _picture(header: Header, time: int, picture: GreyImage, compressed: bool) -> _Sent:
    if compressed:
        message = CompressedImageMessage(header, "mono8; png compressed", encode_png(picture))
        return _Sent(time, f"{IMAGE_TOPIC}/compressed", message)
    height, width = picture.shape
    raw = ImageMessage(header, height, width, "mono8", False, width, picture.tobytes())
    return _Sent(time, IMAGE_TOPIC, raw)


def _camera_info(header: Header, camera: Camera) -> CameraInfoMessage:
    fx, fy, cx, cy = camera.fx, camera.fy, camera.cx, camera.cy
    return CameraInfoMessage(
        header,
        width=camera.width,
        height=camera.height,
        distortion_model=camera.model,
        d=camera.distortion,
        k=(fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0),
        p=(fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0),
        binning_x=0,
        binning_y=0,
        roi=(0, 0, 0, 0),
    )
