"""The one pass over a recording: all poses and intrinsics, and where in the file the images lie."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from handeye_cli.recording import container, transforms
from handeye_cli.recording.clock import Clock
from handeye_cli.recording.container import Channel, Position, RawMessage
from handeye_cli.recording.decoding import ChannelDecoder, decoder_for
from handeye_cli.recording.messages import (
    AnyImage,
    CameraInfoMessage,
    CompressedImageMessage,
    Header,
    ImageMessage,
    PoseStamped,
    Role,
    TransformsMessage,
    TransformStamped,
)
from handeye_cli.records import IntArray

_STATIC_TOPIC = "tf_static"


@dataclass(frozen=True)
class ImageFrames:
    """The images of one topic.

    Attributes:
        decoder: Reads them.
        first: The first image without its pixels; of a compressed one the first bytes are kept.
        stamps_ns: (n,) times in their headers.
        log_times_ns: (n,) times of recording.
        positions: Where they lie in the file.
    """

    decoder: ChannelDecoder
    first: AnyImage
    stamps_ns: IntArray
    log_times_ns: IntArray
    positions: tuple[Position, ...]

    @property
    def topic(self) -> str:
        """Name of the topic."""
        return self.decoder.channel.topic

    @property
    def frame_id(self) -> str:
        """The camera's frame."""
        return transforms.plain_name(self.first.header.frame_id)

    def times_ns(self, clock: Clock) -> IntArray:
        """Return the (n,) times by one of the clocks."""
        return self.stamps_ns if clock is Clock.STAMP else self.log_times_ns


@dataclass(frozen=True)
class Survey:
    """What a recording holds.

    Attributes:
        path: The file.
        cut: Whether its end is missing.
        channels: All channels, also those that cannot be read.
        images: By topic.
        camera_infos: By topic, each different one once, without its stamp.
        links: Cleaned transforms of TF.
        poses: Cleaned stamped poses, the topic's name standing for the unnamed frame.
        dropped: Number of transforms and poses that were not valid.
    """

    path: str
    cut: bool
    channels: tuple[Channel, ...]
    images: Mapping[str, ImageFrames]
    camera_infos: Mapping[str, tuple[CameraInfoMessage, ...]]
    links: tuple[transforms.Samples, ...]
    poses: tuple[transforms.Samples, ...]
    dropped: int


def take(path: str) -> Survey:
    """Return what an MCAP file holds.

    Raises:
        InputError: The file cannot be opened, is no MCAP file or is damaged.
    """
    surveyor = _Surveyor()
    for message in container.scan(path, surveyor.wants):
        surveyor.add(message)
    links, bad_links = _cleaned(surveyor.links.values())
    poses, bad_poses = _cleaned(surveyor.poses.values())
    return Survey(
        path=path,
        cut=container.is_cut(path),
        channels=tuple(surveyor.channels),
        images={topic: images.finished() for topic, images in surveyor.images.items()},
        camera_infos={topic: tuple(infos) for topic, infos in surveyor.camera_infos.items()},
        links=links,
        poses=poses,
        dropped=bad_links + bad_poses,
    )


@dataclass
class _PoseList:
    """Samples in compact arrays, for a recording may hold millions."""

    parent: str
    child: str
    static: bool
    stamps_ns: array[int] = field(default_factory=lambda: array("q"))
    log_times_ns: array[int] = field(default_factory=lambda: array("q"))
    numbers: array[float] = field(default_factory=lambda: array("d"))

    def add(self, log_time_ns: int, message: TransformStamped | PoseStamped) -> None:
        self.stamps_ns.append(message.header.stamp_ns)
        self.log_times_ns.append(log_time_ns)
        self.numbers.extend(message.translation)
        self.numbers.extend(message.rotation)

    def finished(self) -> transforms.Samples:
        return transforms.Samples(
            self.parent,
            self.child,
            self.static,
            np.array(self.stamps_ns, dtype=np.int64),
            np.array(self.log_times_ns, dtype=np.int64),
            np.array(self.numbers, dtype=np.float64).reshape(-1, 7),
        )


@dataclass
class _ImageList:
    decoder: ChannelDecoder
    first: AnyImage
    stamps_ns: array[int] = field(default_factory=lambda: array("q"))
    log_times_ns: array[int] = field(default_factory=lambda: array("q"))
    positions: list[Position] = field(default_factory=list)

    def add(self, message: RawMessage) -> None:
        self.stamps_ns.append(self.decoder.header(message.data).stamp_ns)
        self.log_times_ns.append(message.log_time_ns)
        self.positions.append(message.position)

    def finished(self) -> ImageFrames:
        return ImageFrames(
            self.decoder,
            self.first,
            np.array(self.stamps_ns, dtype=np.int64),
            np.array(self.log_times_ns, dtype=np.int64),
            tuple(self.positions),
        )


class _Surveyor:
    """Sorts messages by what they are good for."""

    def __init__(self) -> None:
        self.channels: list[Channel] = []
        self.images: dict[str, _ImageList] = {}
        self.camera_infos: dict[str, dict[CameraInfoMessage, None]] = {}
        self.links: dict[tuple[str, str, bool], _PoseList] = {}
        self.poses: dict[tuple[str, str], _PoseList] = {}
        self._decoders: dict[Channel, ChannelDecoder] = {}

    def wants(self, channel: Channel) -> bool:
        """Take note of a channel; return whether its messages are of use."""
        self.channels.append(channel)
        decoder = decoder_for(channel)
        if decoder is not None:
            self._decoders[channel] = decoder
        return decoder is not None

    def add(self, message: RawMessage) -> None:
        """Take in a message of a channel that is of use."""
        decoder = self._decoders[message.channel]
        if decoder.role is Role.IMAGE:
            self._add_image(decoder, message)
            return
        content = decoder.decode(message.data)
        if isinstance(content, CameraInfoMessage):
            known = self.camera_infos.setdefault(message.channel.topic, {})
            known[replace(content, header=Header(0, content.header.frame_id))] = None
        elif isinstance(content, TransformsMessage):
            for transform in content.transforms:
                self._add_link(message, transform)
        elif isinstance(content, PoseStamped):
            self._add_pose(message, content)

    def _add_image(self, decoder: ChannelDecoder, message: RawMessage) -> None:
        topic = message.channel.topic
        if topic not in self.images:
            first = decoder.decode(message.data)
            if not isinstance(first, ImageMessage | CompressedImageMessage):
                raise TypeError(f"{type(first).__name__} is no image")
            self.images[topic] = _ImageList(decoder, replace(first, data=first.data[:16]))
        self.images[topic].add(message)

    def _add_link(self, message: RawMessage, transform: TransformStamped) -> None:
        parent = transforms.plain_name(transform.header.frame_id)
        child = transforms.plain_name(transform.child_frame_id)
        static = message.channel.topic.rsplit("/", 1)[-1] == _STATIC_TOPIC
        link = self.links.setdefault((parent, child, static), _PoseList(parent, child, static))
        link.add(message.log_time_ns, transform)

    def _add_pose(self, message: RawMessage, pose: PoseStamped) -> None:
        topic, parent = message.channel.topic, transforms.plain_name(pose.header.frame_id)
        poses = self.poses.setdefault((topic, parent), _PoseList(parent, topic, static=False))
        poses.add(message.log_time_ns, pose)


def _cleaned(lists: Iterable[_PoseList]) -> tuple[tuple[transforms.Samples, ...], int]:
    raw = [each.finished() for each in lists]
    good = tuple(transforms.clean(samples) for samples in raw)
    dropped = sum(len(r.numbers) - len(g.numbers) for r, g in zip(raw, good, strict=True))
    return tuple(samples for samples in good if len(samples.numbers)), dropped
