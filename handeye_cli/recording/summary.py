"""What a recording holds and what of it would be used, without stopping at what is ambiguous."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError
from handeye_cli.recording import selection, stations, survey
from handeye_cli.recording.moving import moving_frames
from handeye_cli.recording.options import McapOptions
from handeye_cli.recording.selection import AmbiguousError
from handeye_cli.recording.several_files import Paths
from handeye_cli.recording.survey import ImageFrames, Survey
from handeye_cli.recording.timeline import Timeline, timeline
from handeye_cli.recording.topics import TopicCounter
from handeye_cli.recording.transforms import Chain, Samples
from handeye_cli.records import Camera, Finding, Inspection, Recording
from handeye_cli.records.recording_summary import (
    LinkSummary,
    MissingFlag,
    Motion,
    PauseSummary,
    RecordingSummary,
    UsedParts,
)

Chosen = TypeVar("Chosen")

_PLACEHOLDERS = {"--setup": "WHERE", "--target": "SPEC", "--gripper-frame": "FRAME"}
"""Words for values that are not known; any other flag's is a topic."""
_TOPIC = "TOPIC"


@dataclass(frozen=True)
class Looked:
    """What one pass over a recording told.

    Attributes:
        inspection: What is in it; choices that have to be made first are errors of the diagnosis.
        recording: Its stations, or None while something is in the way of reading it.
    """

    inspection: Inspection
    recording: Recording | None


def look(path: Paths, options: McapOptions, flags: Mapping[str, Any]) -> Looked:
    """Look into an MCAP recording, and read it where nothing is in the way of that.

    Args:
        path: The MCAP file, a folder, or several of these.
        options: Choices; what they leave open is looked for in the file.
        flags: The choices as they were given on the command line, by name without dashes.

    Raises:
        InputError: The file cannot be opened or is no MCAP file.
        UsageError: Options contradict each other.
    """
    counter = TopicCounter()
    content = survey.take(path, counter.add)
    chooser = _Chooser(content, options)
    missing = chooser.missing
    summary = RecordingSummary(
        duration=counter.duration(),
        cut=content.cut,
        topics=counter.topics(content.channels),
        links=_links(content),
        pauses=_pauses(chooser.line),
        ready=not missing and all(each.severity != "error" for each in chooser.findings),
        used=chooser.used(flags.get("camera")),
        missing=missing,
        command=_command(path, flags, missing),
    )
    inspection = Inspection(
        setup=options.setup, stations=(), diagnosis=tuple(chooser.findings), recording=summary
    )
    if options.setup is None or not summary.ready:
        return Looked(inspection, None)
    return Looked(inspection, stations.recording_of(content, options, options.setup))


class _Chooser:
    """Chooses as reading does, and goes on where that would stop."""

    def __init__(self, content: Survey, options: McapOptions) -> None:
        self.content, self.options = content, options
        self.findings: list[Finding] = stations.file_findings(content)
        self._open: list[MissingFlag] = []
        self.frames = self._try("no-images", self._choose_images)
        self.chain = self._try("no-robot-poses", self._choose_chain)
        self.camera = self._try("no-intrinsics", self._choose_camera) if self.frames else None
        self.line = self._timeline()

    @property
    def missing(self) -> tuple[MissingFlag, ...]:
        """Flags without which the recording cannot be read."""
        told = [
            MissingFlag("--setup", tuple(Setup)) if self.options.setup is None else None,
            MissingFlag("--target") if self.options.target is None else None,
        ]
        return (*(each for each in told if each is not None), *self._open)

    def used(self, camera_file: str | None) -> UsedParts:
        """Return what was chosen, beside the file of the intrinsics if one was named."""
        return UsedParts(
            image_topic=self.frames.topic if self.frames else None,
            camera_info_topic=self._camera_info_topic() if self.camera else None,
            camera=self.camera,
            camera_file=camera_file,
            pose_topic=_pose_topic(self.content, self.chain),
            frames=_way(self.chain),
            clock=str(self.line.clock) if self.line else None,
        )

    def _try(self, code: str, choose: Callable[[], Chosen]) -> Chosen | None:
        try:
            return choose()
        except AmbiguousError as error:
            self._open.append(MissingFlag(error.flag, error.choices))
            self._tell(f"ambiguous-{error.flag.removeprefix('--')}", error)
        except InputError as error:
            self._tell(code, error)
        return None

    def _tell(self, code: str, error: InputError) -> None:
        self.findings.append(Finding(code, "error", error.message, error.hint or ""))

    def _choose_images(self) -> ImageFrames:
        return selection.images(self.content, self.options.image_topic)

    def _choose_chain(self) -> Chain:
        camera_frame = self.frames.frame_id if self.frames else ""
        return selection.robot_chain(self.content, camera_frame, self.options)

    def _choose_camera(self) -> Camera | None:
        assert self.frames is not None
        camera, found = stations.camera_for(self.content, self.frames, self.options)
        self.findings += found
        return camera

    def _camera_info_topic(self) -> str | None:
        assert self.frames is not None
        wanted = self.options.camera_info_topic
        return selection.camera_info_topic(self.content, self.frames, wanted)

    def _timeline(self) -> Timeline | None:
        if self.frames is None or self.chain is None:
            return None
        line = timeline(self.frames, self.chain, self.options)
        self.findings += [line.clock_finding] if line.clock_finding else []
        moving = moving_frames(self.content.path, self.frames, line, self.options)
        self.findings += stations.usage_findings(line, moving)
        self._try("no-stations", lambda: stations.require_stations(self.content.path, line, moving))
        return line


def _links(content: Survey) -> tuple[LinkSummary, ...]:
    links = sorted(content.links, key=lambda link: (link.parent, link.child, link.static))
    return tuple(
        LinkSummary(link.parent, link.child, _motion(link), len(link.numbers)) for link in links
    )


def _motion(link: Samples) -> Motion:
    if link.static:
        return Motion.STATIC
    return Motion.MOVING if link.moves else Motion.STILL


def _pauses(line: Timeline | None) -> tuple[PauseSummary, ...]:
    if line is None or not len(line.robot.times_ns):
        return ()
    first = int(line.robot.times_ns[0])
    # a pause ends a nanosecond after its last pose
    return tuple(
        PauseSummary((start - first) / 1e9, (end - 1 - start) / 1e9, len(group))
        for (start, end), group in zip(line.pauses.tolist(), line.images, strict=True)
    )


def _pose_topic(content: Survey, chain: Chain | None) -> str | None:
    links = () if chain is None else chain.to_gripper
    topics = (topic for topic, samples in content.poses.items() if samples is links)
    return next(topics, None)


def _way(chain: Chain | None) -> tuple[str, ...]:
    """Return the frames from the base up to the common ancestor and down to the gripper."""
    if chain is None:
        return ()
    up = [link.child for link in reversed(chain.to_base)]
    first = (*chain.to_base, *chain.to_gripper)[:1]
    return (*up, *(link.parent for link in first), *(link.child for link in chain.to_gripper))


def _command(path: Paths, flags: Mapping[str, Any], missing: tuple[MissingFlag, ...]) -> str:
    words = ["handeye", "solve", *([path] if isinstance(path, str) else path)]
    for name, value in flags.items():
        words += [f"--{name}"] if value is True else [f"--{name}", str(value)]
    for each in missing:
        words += [each.flag, _PLACEHOLDERS.get(each.flag, _TOPIC)]
    return shlex.join(words)
