"""The one pass over a recording: all poses and intrinsics, and where in the file the images lie."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from handeye_cli.errors import InputError
from handeye_cli.recording import container, joint_states, several_files, transforms, urdf
from handeye_cli.recording.bag_folder import BagFiles
from handeye_cli.recording.clock import Clock
from handeye_cli.recording.container import Channel, Position, RawMessage
from handeye_cli.recording.decoding import ChannelDecoder, decoder_for
from handeye_cli.recording.known_links import KnownLinks
from handeye_cli.recording.losses import Losses, Unreadable
from handeye_cli.recording.messages import (
    AnyImage,
    CameraInfoMessage,
    CompressedImageMessage,
    Header,
    ImageMessage,
    JointsMessage,
    PoseStamped,
    Role,
    TextMessage,
    TransformsMessage,
    TransformStamped,
)
from handeye_cli.recording.pose_list import PoseList
from handeye_cli.recording.several_files import Paths
from handeye_cli.records import IntArray

_STATIC_TOPIC = "tf_static"
_DESCRIPTION = "<robot"
"""What tells a robot's description from other texts."""
_HEADER_BYTES = 4096
"""More than any header takes."""


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
        path: What it is called in messages: its file or folder, or the first of several.
        files: Its files.
        losses: What of it is missing or damaged, as far as it may have been of use.
        aside: What is damaged of messages that are of no use, where these were read too.
        unreadable: Messages that cannot be decoded, by topic.
        channels: All channels, also those that cannot be read.
        images: By topic.
        camera_infos: By topic, each different one once, without its stamp.
        links: Cleaned transforms of TF.
        poses: Cleaned stamped poses by topic, whose name stands for a frame without one.
        dropped: Number of transforms and poses that were not valid.
        computed: Number of links that follow from the robot's joints and its description.
        heard: Those of the channels that have messages of use.
    """

    path: str
    files: BagFiles
    losses: Losses
    aside: Losses
    unreadable: Mapping[str, Unreadable]
    channels: tuple[Channel, ...]
    images: Mapping[str, ImageFrames]
    camera_infos: Mapping[str, tuple[CameraInfoMessage, ...]]
    links: tuple[transforms.Samples, ...]
    poses: Mapping[str, tuple[transforms.Samples, ...]]
    dropped: int
    computed: int = 0
    heard: frozenset[Channel] = frozenset()

    def is_silent(self, channel: Channel) -> bool:
        """Return whether messages of a channel would be of use, and there is none."""
        return channel not in self.heard and decoder_for(channel) is not None

    @property
    def cut(self) -> bool:
        """Whether the end of a file is missing."""
        return self.losses.cut > 0


def take(path: Paths, tell: Callable[[RawMessage], None] | None = None) -> Survey:
    """Return what a recording holds; what is damaged in it is left out and counted.

    Args:
        path: An MCAP file, the folder of a recording in several files, or several of these.
        tell: Told of every message, also of those that cannot be read, or None.

    Raises:
        InputError: A file cannot be opened or is no MCAP file, or there is none in the folder.
    """
    surveyor, losses, aside = _Surveyor(), Losses(), Losses()
    files = several_files.files_of(path)
    for file in files.paths:
        for message in container.scan(file, surveyor.wants, losses, aside if tell else None):
            if tell is not None:
                tell(message)
            surveyor.add(message)
    links, dropped = _cleaned(surveyor.links.values())
    links, computed = joint_states.with_joints(links, surveyor.robot, surveyor.joints)
    poses: dict[str, tuple[transforms.Samples, ...]] = {}
    for topic, lists in surveyor.poses.items():
        good, bad = _cleaned(lists.values())
        poses |= {topic: good} if good else {}
        dropped += bad
    return Survey(
        path=several_files.name_of(path),
        files=files,
        losses=losses,
        aside=aside,
        unreadable=surveyor.unreadable(),
        channels=tuple(surveyor.channels),
        images={topic: images.finished() for topic, images in surveyor.images.items()},
        camera_infos={topic: tuple(infos) for topic, infos in surveyor.camera_infos.items()},
        links=links,
        poses=poses,
        dropped=dropped,
        computed=computed,
        heard=surveyor.heard(),
    )


@dataclass
class _ImageList:
    decoder: ChannelDecoder
    first: AnyImage
    stamps_ns: array[int] = field(default_factory=lambda: array("q"))
    log_times_ns: array[int] = field(default_factory=lambda: array("q"))
    positions: list[Position] = field(default_factory=list)

    def add(self, message: RawMessage) -> None:
        self.stamps_ns.append(_header(self.decoder, message).stamp_ns)
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


@dataclass
class _Feed:
    """What becomes of the messages of a channel that can be read.

    Attributes:
        take: Takes in one of them.
        count: How many there were.
    """

    take: Callable[[RawMessage], None]
    count: int = 0


class _Surveyor:
    """Sorts messages by what they are good for."""

    def __init__(self) -> None:
        self.channels: dict[Channel, None] = {}
        self.images: dict[str, _ImageList] = {}
        self.camera_infos: dict[str, dict[CameraInfoMessage, None]] = {}
        self.links: dict[tuple[str, str, bool], PoseList] = {}
        self.poses: dict[str, dict[tuple[str, str], PoseList]] = {}
        self.joints = joint_states.JointRecord()
        self.robot: tuple[urdf.Joint, ...] = ()
        self._unreadable: dict[str, Unreadable] = {}
        self._feeds: dict[Channel, _Feed] = {}

    def wants(self, channel: Channel) -> bool:
        """Take note of a channel; return whether its messages are of use."""
        self.channels[channel] = None
        decoder = decoder_for(channel)
        if decoder is not None and channel not in self._feeds:
            self._feeds[channel] = _Feed(self._way(decoder))
        return decoder is not None

    def add(self, message: RawMessage) -> None:
        """Take in a message if it is of use; count it if it should be and cannot be read."""
        feed = self._feeds.get(message.channel)
        if feed is None:
            return
        feed.count += 1
        try:
            feed.take(message)
        except InputError as error:
            self._unreadable.setdefault(message.channel.topic, Unreadable(error)).count += 1

    def unreadable(self) -> dict[str, Unreadable]:
        """Return the messages that should be of use and cannot be read, by topic."""
        totals: Counter[str] = Counter()
        for channel, feed in self._feeds.items():
            totals[channel.topic] += feed.count
        return {t: replace(bad, total=totals[t]) for t, bad in self._unreadable.items()}

    def heard(self) -> frozenset[Channel]:
        """Return the channels with messages of use."""
        return frozenset(channel for channel, feed in self._feeds.items() if feed.count)

    def _way(self, decoder: ChannelDecoder) -> Callable[[RawMessage], None]:
        """Return what takes in the messages of a channel."""
        if decoder.role is Role.IMAGE:
            return partial(self._add_image, decoder)
        if decoder.role is Role.TRANSFORMS:
            return partial(self._add_transforms, decoder, KnownLinks())
        return partial(self._add_other, decoder)

    def _add_other(self, decoder: ChannelDecoder, message: RawMessage) -> None:
        content = decoder.decode(message.data)
        if isinstance(content, CameraInfoMessage):
            known = self.camera_infos.setdefault(message.channel.topic, {})
            known[replace(content, header=Header(0, content.header.frame_id))] = None
        elif isinstance(content, PoseStamped):
            self._add_stamped(message, content)
        elif isinstance(content, JointsMessage):
            self.joints.add(message.log_time_ns, content)
        elif isinstance(content, TextMessage) and _DESCRIPTION in content.text:
            self.robot += urdf.parse(content.text, message.channel.topic)

    def _add_image(self, decoder: ChannelDecoder, message: RawMessage) -> None:
        topic = message.channel.topic
        if topic not in self.images:
            first = decoder.decode(message.data)
            if not isinstance(first, ImageMessage | CompressedImageMessage):
                raise TypeError(f"{type(first).__name__} is no image")
            self.images[topic] = _ImageList(decoder, replace(first, data=first.data[:16]))
        first_kind, kind = (_kind(each.channel) for each in (self.images[topic].decoder, message))
        if kind != first_kind:
            raise InputError(f"expected {first_kind} as before, found {kind}", where=topic)
        self.images[topic].add(message)

    def _add_transforms(
        self, decoder: ChannelDecoder, known: KnownLinks, message: RawMessage
    ) -> None:
        data = message.data
        if known.add(message.log_time_ns, data):
            return
        content = decoder.decode(data)
        if not isinstance(content, TransformsMessage):
            raise TypeError(f"{type(content).__name__} holds no transforms")
        lists = [self._link(message, each, content.lasting) for each in content.transforms]
        for link, transform in zip(lists, content.transforms, strict=True):
            _add_pose(link, message, transform)
        places = decoder.places(data) if lists and known.has_room_for(data) else ()
        if places:
            known.learn(data, places, lists)

    def _link(self, message: RawMessage, transform: TransformStamped, lasting: bool) -> PoseList:
        parent = transforms.plain_name(transform.header.frame_id)
        child = transforms.plain_name(transform.child_frame_id)
        static = message.channel.topic.rsplit("/", 1)[-1] == _STATIC_TOPIC
        key = (parent, child, static)
        if key not in self.links:
            self.links[key] = PoseList(parent, child, static, lasting)
        return self.links[key]

    def _add_stamped(self, message: RawMessage, pose: PoseStamped) -> None:
        topic, parent = message.channel.topic, transforms.plain_name(pose.header.frame_id)
        child = transforms.plain_name(pose.child_frame_id) or topic
        of_topic = self.poses.setdefault(topic, {})
        poses = of_topic.setdefault((parent, child), PoseList(parent, child))
        _add_pose(poses, message, pose)


def _add_pose(poses: PoseList, message: RawMessage, pose: TransformStamped | PoseStamped) -> None:
    numbers = (*pose.translation, *pose.rotation)
    poses.add(message.log_time_ns, pose.header.stamp_ns, numbers)


def _kind(channel: Channel) -> str:
    return f"{channel.schema_name} as {channel.message_encoding}"


def _header(decoder: ChannelDecoder, message: RawMessage) -> Header:
    """Return the header of an image, read without the pixels where it stands before them."""
    data = message.beginning(_HEADER_BYTES)
    if not decoder.is_in_order(data):
        data = message.data
    return decoder.header(data)


def _cleaned(lists: Iterable[PoseList]) -> tuple[tuple[transforms.Samples, ...], int]:
    raw = [each.finished() for each in lists]
    good = tuple(transforms.clean(samples) for samples in raw)
    dropped = sum(len(r.numbers) - len(g.numbers) for r, g in zip(raw, good, strict=True))
    return tuple(samples for samples in good if len(samples.numbers)), dropped
