"""A recording's stations: one for every pause of the robot that has an image.

Of a robot that hardly pauses they are frames along its way.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError
from handeye_cli.geometry import se3
from handeye_cli.recording import container, findings, selection, several_files, survey
from handeye_cli.recording.frames import FRAMES_PER_PAUSE, StationFrames, evenly
from handeye_cli.recording.intrinsics import camera_of, is_rectified
from handeye_cli.recording.moving import FEWEST_FRAMES, moving_frames
from handeye_cli.recording.options import McapOptions
from handeye_cli.recording.several_files import Paths
from handeye_cli.recording.survey import ImageFrames, Survey
from handeye_cli.recording.timeline import RobotPath, Timeline, timeline
from handeye_cli.recording.transforms import Chain
from handeye_cli.records import (
    Camera,
    Finding,
    FloatArray,
    IntArray,
    RecordedStation,
    Recording,
)
from handeye_cli.records.frames import RobotFrames
from handeye_cli.records.moving import MovingFrames


def read(paths: Paths, options: McapOptions) -> Recording:
    """Return the stations of an MCAP recording, in order of time.

    Of a robot that hardly pauses they are frames along its way, and so they are on demand.

    What is damaged in a file is left out, and a finding says how much that is.

    Args:
        paths: An MCAP file, the folder of a recording in several files, or several of these.
        options: What the recording cannot say, and choices where it says more than one thing.

    Raises:
        InputError: A file is no MCAP; the recording lacks images, poses or pauses, or what is not
            damaged in it does; or a choice is ambiguous, and the message lists what there is.
        UsageError: Options contradict each other.
    """
    path = several_files.name_of(paths)
    for file in several_files.files_of(paths).paths:
        container.require_mcap(file)
    if options.setup is None:
        choices = " or ".join(Setup)
        raise InputError(
            "expected to be told where the camera is fixed, which no recording says",
            where=path,
            hint=f"give --setup {choices}",
        )
    return recording_of(survey.take(paths), options, options.setup)


def recording_of(content: Survey, options: McapOptions, setup: Setup) -> Recording:
    """Return the stations of a recording that was looked through; see `read`.

    Args:
        content: What it holds.
        options: What it cannot say, and choices where it says more than one thing.
        setup: Where the camera is fixed.

    Raises:
        InputError: The recording lacks images, poses or pauses, or a choice is ambiguous.
        UsageError: Options contradict each other.
    """
    path = content.path
    with _with_damage_named(content):
        frames = selection.images(content, options.image_topic)
        camera, camera_findings = camera_for(content, frames, options)
        chain = selection.robot_chain(content, frames.frame_id, options)
        line = timeline(frames, chain, options)
        moving = moving_frames(path, frames, line, options)
        require_stations(path, line, moving)
    told = [line.clock_finding] if line.clock_finding else []
    told.append(findings.choices(chain.base, chain.gripper, frames.topic))
    return Recording(
        setup=setup,
        stations=_stations(path, frames, line, moving),
        target=options.target,
        camera=camera,
        findings=(*file_findings(content), *camera_findings, *told, *usage_findings(line, moving)),
        moving=moving,
        frames=_robot_frames(content, frames, chain),
    )


def _robot_frames(content: Survey, frames: ImageFrames, chain: Chain) -> RobotFrames:
    # poses without a name for what they are of have their topic's
    gripper = "" if chain.gripper in content.poses else chain.gripper
    return RobotFrames(chain.base, gripper, frames.frame_id, int(frames.log_times_ns.min()))


@contextmanager
def _with_damage_named(content: Survey) -> Iterator[None]:
    """Name the file, and add to what is missing in it that parts of it cannot be read."""
    try:
        yield
    except InputError as error:
        error.where = error.where or content.path
        if content.losses.places:
            error.message += f"; it is damaged: {content.losses.first}"
        for topic, bad in content.unreadable.items():
            if bad.count == bad.total:
                error.message += f"; no message of {topic} can be read: {bad.first}"
        raise


def camera_for(
    content: Survey, frames: ImageFrames, options: McapOptions
) -> tuple[Camera | None, list[Finding]]:
    """Return the camera of the images and what is to be said of it.

    Raises:
        InputError: Several intrinsics could be meant, or theirs is no lens that is known.
    """
    if options.own_intrinsics:
        return None, []
    topic = selection.camera_info_topic(content, frames, options.camera_info_topic)
    if topic is None:
        return None, [findings.camera_info_missing(frames.topic)]
    infos = content.camera_infos[topic]
    camera = camera_of(infos[0], frames.topic, f"{content.path}, {topic}")
    rectified = is_rectified(frames.topic)
    found = [] if camera else [findings.camera_uncalibrated(topic, rectified=rectified)]
    if len(infos) > 1:
        found.append(findings.camera_info_changes(topic, len(infos)))
    return camera, found


def _stations(
    path: str, frames: ImageFrames, line: Timeline, moving: MovingFrames | None
) -> tuple[RecordedStation, ...]:
    if moving is not None and moving.are_stations:
        return tuple(moving.frames[index] for index in moving.stations)
    seen = [
        (pause, group) for pause, group in zip(line.pauses, line.images, strict=True) if len(group)
    ]
    width = max(2, len(str(len(seen) - 1)))
    return tuple(
        RecordedStation(
            name=f"{index:0{width}d}",
            base_T_gripper=_mean_pose(line.robot, pause),
            image=_image(path, frames, line.image_times_ns, group),
        )
        for index, (pause, group) in enumerate(seen)
    )


def _mean_pose(robot: RobotPath, pause: IntArray) -> FloatArray:
    first, last = np.searchsorted(robot.times_ns, pause)
    return se3.mean(robot.poses[first:last])


def _image(path: str, frames: ImageFrames, image_times: IntArray, group: IntArray) -> StationFrames:
    chosen = evenly(group[np.argsort(image_times[group], kind="stable")], FRAMES_PER_PAUSE)
    positions = tuple(frames.positions[index] for index in chosen)
    return StationFrames(path, frames.decoder, positions, int(image_times[chosen[0]]))


def require_stations(path: str, line: Timeline, moving: MovingFrames | None) -> None:
    """Check that the robot stood still while an image was taken, or that frames in motion will do.

    Raises:
        InputError: Neither is so.
    """
    if line.stations or (moving is not None and moving.are_stations):
        return
    pauses = len(line.pauses)
    found = f"{pauses} pauses without one" if pauses else "no pause"
    few = moving is None
    along = f"fewer than {FEWEST_FRAMES}" if moving is None else f"{len(moving.frames)}"
    raise InputError(
        f"expected pauses of the robot with images, found {found} in {line.robot.seconds:.1f} s of"
        f" poses, and {along} frames along its way",
        where=path,
        hint=("" if few else "take the frames along its way with --moving; or ")
        + "let the robot stand still for a second at every station"
        + (", or move on for longer" if few else "")
        + "; if it did, check the frames, and the clocks with --time-offset",
    )


def file_findings(content: Survey) -> list[Finding]:
    """Return what is to be said of the files themselves."""
    found, losses = list(content.files.findings), content.losses
    if losses.cut:
        found.append(findings.cut(losses.cut, losses.cut_bytes))
    if losses.places:
        lost = losses.places, losses.bytes, losses.messages
        found.append(findings.damaged(*lost, first=losses.first))
    if content.aside.places:
        found.append(findings.damaged_aside(content.aside.places, content.aside.first))
    for topic, bad in content.unreadable.items():
        found.append(findings.messages_unreadable(topic, bad.count, bad.total, str(bad.first)))
    if content.dropped:
        found.append(findings.transforms_dropped(content.dropped))
    if content.computed:
        found.append(findings.links_computed(content.computed))
    return found


def usage_findings(line: Timeline, moving: MovingFrames | None) -> list[Finding]:
    """Return which images and pauses are of no use."""
    found = []
    frame_count = len(line.image_times_ns)
    if moving is not None and moving.are_stations:
        return [findings.stations_moving(len(moving.stations), frame_count, line.stations)]
    unused = frame_count - sum(len(group) for group in line.images)
    if unused:
        found.append(findings.frames_moving(unused, frame_count))
    empty = len(line.images) - line.stations
    if empty:
        found.append(findings.pauses_without_image(empty, len(line.images)))
    return found
