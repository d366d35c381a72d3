"""A recording's stations: one for every pause of the robot that has an image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError
from handeye_cli.geometry import se3
from handeye_cli.recording import clock, container, findings, selection, survey
from handeye_cli.recording.clock import Clock
from handeye_cli.recording.frames import FRAMES_PER_PAUSE, PausedFrames, evenly
from handeye_cli.recording.intrinsics import camera_of
from handeye_cli.recording.options import McapOptions
from handeye_cli.recording.pauses import find_pauses
from handeye_cli.recording.survey import ImageFrames, Survey
from handeye_cli.recording.transforms import Chain
from handeye_cli.records import (
    Camera,
    Finding,
    FloatArray,
    IntArray,
    RecordedStation,
    Recording,
)


def read(path: str, options: McapOptions) -> Recording:
    """Return the stations of an MCAP recording, in order of time.

    Raises:
        InputError: The file is no MCAP, is damaged, or lacks images, poses or pauses; or a choice
            is ambiguous, and the message lists what there is.
        UsageError: Options contradict each other.
    """
    container.require_mcap(path)
    if options.setup is None:
        choices = " or ".join(Setup)
        raise InputError(
            "expected to be told where the camera is fixed, which no recording says",
            where=path,
            hint=f"give --setup {choices}",
        )
    content = survey.take(path)
    frames = selection.images(content, options.image_topic)
    camera, camera_findings = _camera(content, frames, options)
    chain = selection.robot_chain(content, frames.frame_id, options)
    stations, station_findings = _stations(path, frames, chain, options)
    return Recording(
        setup=options.setup,
        stations=stations,
        target=options.target,
        camera=camera,
        findings=(*_file_findings(content), *camera_findings, *station_findings),
    )


def _camera(
    content: Survey, frames: ImageFrames, options: McapOptions
) -> tuple[Camera | None, list[Finding]]:
    topic = selection.camera_info_topic(content, frames, options.camera_info_topic)
    if topic is None:
        return None, [findings.camera_info_missing(frames.topic)]
    infos = content.camera_infos[topic]
    camera = camera_of(infos[0], frames.topic)
    found = [] if camera else [findings.camera_uncalibrated(topic)]
    if len(infos) > 1:
        found.append(findings.camera_info_changes(topic, len(infos)))
    return camera, found


@dataclass(frozen=True)
class _Path:
    """The robot's poses, where all links of the chain are known.

    Attributes:
        times_ns: (n,) times.
        poses: (n, 4, 4) `base_T_gripper`.
    """

    times_ns: IntArray
    poses: FloatArray


def _stations(
    path: str, frames: ImageFrames, chain: Chain, options: McapOptions
) -> tuple[tuple[RecordedStation, ...], list[Finding]]:
    source, clock_finding = _clock(frames, chain)
    image_times = frames.times_ns(source) + options.time_offset_ns
    robot = _robot_path(chain, source)
    pauses = find_pauses(robot.times_ns, robot.poses, options.pauses)
    groups = [np.flatnonzero((image_times >= a) & (image_times < b)) for a, b in pauses]
    seen = [(pause, group) for pause, group in zip(pauses, groups, strict=True) if len(group)]
    _require_stations(path, len(seen), len(pauses), robot)
    width = max(2, len(str(len(seen) - 1)))
    stations = tuple(
        RecordedStation(
            name=f"{index:0{width}d}",
            base_T_gripper=_mean_pose(robot, pause),
            image=_image(path, frames, image_times, group),
        )
        for index, (pause, group) in enumerate(seen)
    )
    choices = findings.choices(chain.base, chain.gripper, frames.topic)
    found = [choices, *_usage_findings(groups, len(image_times))]
    return stations, [clock_finding, *found] if clock_finding else found


def _clock(frames: ImageFrames, chain: Chain) -> tuple[Clock, Finding | None]:
    return clock.choose(
        frames.stamps_ns,
        frames.log_times_ns,
        np.concatenate([link.stamps_ns for link in chain.dynamic]),
        np.concatenate([link.log_times_ns for link in chain.dynamic]),
    )


def _robot_path(chain: Chain, source: Clock) -> _Path:
    times_ns = chain.sample_times_ns(source)
    poses, known = chain.at(times_ns, source)
    return _Path(times_ns[known], poses[known])


def _mean_pose(robot: _Path, pause: IntArray) -> FloatArray:
    first, last = np.searchsorted(robot.times_ns, pause)
    return se3.mean(robot.poses[first:last])


def _image(path: str, frames: ImageFrames, image_times: IntArray, group: IntArray) -> PausedFrames:
    chosen = evenly(group[np.argsort(image_times[group], kind="stable")], FRAMES_PER_PAUSE)
    positions = tuple(frames.positions[index] for index in chosen)
    return PausedFrames(path, frames.decoder, positions, int(image_times[chosen[0]]))


def _require_stations(path: str, stations: int, pauses: int, robot: _Path) -> None:
    if stations:
        return
    seconds = (robot.times_ns[-1] - robot.times_ns[0]) / 1e9 if len(robot.times_ns) else 0.0
    found = f"{pauses} pauses without one" if pauses else "no pause"
    raise InputError(
        f"expected pauses of the robot with images, found {found} in {seconds:.1f} s of poses",
        where=path,
        hint="let the robot stand still for a second at every station; if it did, check the"
        " frames, and the clocks with --time-offset",
    )


def _file_findings(content: Survey) -> list[Finding]:
    found = [findings.cut()] if content.cut else []
    if content.dropped:
        found.append(findings.transforms_dropped(content.dropped))
    return found


def _usage_findings(groups: list[IntArray], frame_count: int) -> list[Finding]:
    found = []
    unused = frame_count - sum(len(group) for group in groups)
    if unused:
        found.append(findings.frames_moving(unused, frame_count))
    empty = sum(1 for group in groups if not len(group))
    if empty:
        found.append(findings.pauses_without_image(empty, len(groups)))
    return found
