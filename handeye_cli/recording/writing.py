"""A robot's recording into an MCAP file, as ROS 2 would have recorded it; the inverse of reading.

The messages come from several streams, each in the order of its own times, and are merged while
they are written: no more than one picture is in memory at a time, apart from the open chunk.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import IO

from mcap.writer import CompressionType, Writer

from handeye_cli import __version__
from handeye_cli.images import encode_png
from handeye_cli.recording.messages import (
    CameraInfoMessage,
    CompressedImageMessage,
    Header,
    ImageMessage,
    TransformsMessage,
    TransformStamped,
)
from handeye_cli.recording.ros2_channels import PROFILE, STATIC_TOPIC, Ros2Channels, Sent
from handeye_cli.recording.transforms import Samples
from handeye_cli.records import Camera, GreyImage

IMAGE_TOPIC = "/camera/image_raw"
CAMERA_INFO_TOPIC = "/camera/camera_info"
CAMERA_FRAME = "camera_optical_frame"
IMAGE_DELAY_NS = 30_000_000
"""From a picture's stamp to the time at which it is recorded."""

_CHUNK_BYTES = 2**20


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


def write(file: IO[bytes], streams: Streams) -> None:
    """Write a recording; the same bytes for the same streams.

    Args:
        file: An open binary file.
        streams: What there is to record.
    """
    writer = Writer(file, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD)
    writer.start(profile=PROFILE, library=f"handeye {__version__}")
    channels = Ros2Channels(writer)
    links = [_transforms(link) for link in streams.links]
    for sent in heapq.merge(*links, _camera(streams), key=lambda sent: sent.log_time_ns):
        channels.write(sent)
    if streams.notes:
        writer.add_metadata("handeye", dict(streams.notes))
    writer.finish()  # type: ignore[no-untyped-call]


def _transforms(link: Samples) -> Iterator[Sent]:
    topic = STATIC_TOPIC if link.static else "/tf"
    for stamp, log_time, numbers in zip(
        link.stamps_ns.tolist(), link.log_times_ns.tolist(), link.numbers.tolist(), strict=True
    ):
        x, y, z, *quaternion = numbers
        header = Header(stamp, link.parent)
        transform = TransformStamped(header, link.child, (x, y, z), tuple(quaternion))
        yield Sent(log_time, topic, TransformsMessage((transform,)))


def _camera(streams: Streams) -> Iterator[Sent]:
    """Yield the intrinsics and the picture of each stamp, as one stream draws each only once."""
    for stamp, picture in streams.pictures:
        header, time = Header(stamp, CAMERA_FRAME), stamp + IMAGE_DELAY_NS
        yield Sent(time, CAMERA_INFO_TOPIC, _camera_info(header, streams.camera))
        yield _picture(header, time, picture, streams.compressed)


def _picture(header: Header, time: int, picture: GreyImage, compressed: bool) -> Sent:
    if compressed:
        message = CompressedImageMessage(header, "mono8; png compressed", encode_png(picture))
        return Sent(time, f"{IMAGE_TOPIC}/compressed", message)
    height, width = picture.shape
    raw = ImageMessage(header, height, width, "mono8", False, width, picture.tobytes())
    return Sent(time, IMAGE_TOPIC, raw)


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
