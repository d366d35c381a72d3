"""What a robot's recording holds, and what of it would be used."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from handeye_cli.records.basics import Camera


class Motion(StrEnum):
    """What a frame does in the one above it."""

    STATIC = "static"
    STILL = "still"
    MOVING = "moving"


@dataclass(frozen=True)
class TopicSummary:
    """A topic of a recording.

    Attributes:
        name: Its name.
        schema: Name of its messages' schema; empty without one.
        encoding: How they are written.
        count: Number of messages.
        rate: Messages per second from the first to the last, or None for fewer than two.
        role: What they are good for, empty when they are of no use.
    """

    name: str
    schema: str
    encoding: str
    count: int
    rate: float | None = None
    role: str = ""


@dataclass(frozen=True)
class LinkSummary:
    """A frame and the one above it.

    Attributes:
        parent: The frame above.
        child: The frame.
        motion: `static` by declaration; `still` when it is sent again and again and never changes.
        count: Number of samples.
    """

    parent: str
    child: str
    motion: Motion
    count: int


@dataclass(frozen=True)
class PauseSummary:
    """A standstill of the robot.

    Attributes:
        start: Seconds since the first pose of the robot.
        duration: Seconds.
        images: Number of images taken in it; a pause without one is no station.
    """

    start: float
    duration: float
    images: int


@dataclass(frozen=True)
class UsedParts:
    """What of a recording would be used; None where it is not known or there is none.

    Attributes:
        image_topic: Topic of the images.
        camera_info_topic: Topic of the intrinsics.
        camera: These intrinsics.
        camera_file: File of the intrinsics, where they do not come from the recording.
        pose_topic: Topic of the robot's poses, where they do not come from TF.
        frames: Frames on the way from the robot's base to its gripper.
        clock: `header.stamp` or `log_time`.
    """

    image_topic: str | None = None
    camera_info_topic: str | None = None
    camera: Camera | None = None
    camera_file: str | None = None
    pose_topic: str | None = None
    frames: tuple[str, ...] = ()
    clock: str | None = None


@dataclass(frozen=True)
class MissingFlag:
    """A flag that the recording leaves open.

    Attributes:
        flag: Such as `--image-topic`.
        choices: What it may be, where that is known.
    """

    flag: str
    choices: tuple[str, ...] = ()


@dataclass(frozen=True)
class RecordingSummary:
    """A robot's recording at a glance.

    Attributes:
        duration: Seconds from its first message to its last.
        cut: Whether its end is missing.
        topics: In the order of their names.
        links: Frames of TF, in the order of their names.
        pauses: Where the robot stood still, in order of time.
        ready: Whether nothing stands against reading it.
        used: What would be used.
        missing: Flags to fill in before it can be calibrated from.
        command: What to run; words in capitals stand for the missing flags' values.
    """

    duration: float
    cut: bool
    topics: tuple[TopicSummary, ...]
    links: tuple[LinkSummary, ...]
    pauses: tuple[PauseSummary, ...]
    ready: bool
    used: UsedParts
    missing: tuple[MissingFlag, ...]
    command: str
