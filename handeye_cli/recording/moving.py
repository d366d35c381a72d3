"""Frames along the way of a robot, for what needs it to move: the time between images and poses.

Some of them stand in for stations where the robot never pauses. However long the recording is,
there are no more of them than detection bears, spread evenly over all turns and ways of the robot;
so they are neither neighbours in a video nor the same view of a robot at rest. How sharp a frame is
does not count: blur by motion is not looked for.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations
from handeye_cli.recording.frames import StationFrames, evenly
from handeye_cli.recording.options import McapOptions
from handeye_cli.recording.survey import ImageFrames
from handeye_cli.recording.timeline import RobotPath, Timeline
from handeye_cli.records import FloatArray, IntArray, RecordedStation
from handeye_cli.records.moving import MovingFrames

_FEWEST_PAUSES = 3
"""Stations that a calibration needs."""
_RESTLESS = 0.5
"""A robot that stands still for less than this part of its time is not one that pauses."""
MOST_FRAMES = 60
MOST_STATIONS = 20
"""Of these frames: what a robot's pose is off by changes slowly along its way, so frames that lie
closer together say less than their number lets expect."""
FEWEST_FRAMES = 10
"""Frames that thirteen unknowns and three levels of noise are told from, at least."""
_SHORTEST_WAY = 0.2
"""A robot that turns and moves less than this, in radians, does not move."""
_LEVER = 0.5
"""Metres of a way that count as much as a radian."""
_LONGEST_STEP_NS = 100_000_000
_LONGEST_STEP = 3
"""Between samples of the robot farther apart than both, the latter in its usual periods, its pose
in motion is not known."""


def moving_frames(
    name: str, frames: ImageFrames, line: Timeline, options: McapOptions
) -> MovingFrames | None:
    """Return frames along the robot's way, or None where too few tell of a motion.

    Args:
        name: The recording's, for people.
        frames: Its images.
        line: When images were taken and where the robot was.
        options: The time between the two as given, and whether pauses are to be passed over.
    """
    chosen = along_the_way(line)
    if len(chosen) < FEWEST_FRAMES:
        return None
    path, times = line.robot.trajectory, line.robot.seconds_of(line.image_times_ns[chosen])
    width = max(2, len(str(len(chosen) - 1)))
    every = tuple(
        RecordedStation(f"{index:0{width}d}", pose, _image(name, frames, line, image))
        for index, (pose, image) in enumerate(zip(path.at(times), chosen, strict=True))
    )
    index = evenly(np.arange(len(every)), MOST_STATIONS)
    return MovingFrames(
        frames=every,
        times=times,
        path=path,
        stations=index if options.moving or not _pauses(line) else index[:0],
        given=options.time_offset_ns / 1e9,
    )


def along_the_way(line: Timeline) -> IntArray:
    """Return (n,) indices of images, in order of time, at even distances on the robot's way."""
    order = np.argsort(line.image_times_ns, kind="stable")
    known = order[_is_known(line.robot, line.image_times_ns[order])]
    if len(known) < 2:
        return known[:0]
    poses = line.robot.trajectory.at(line.robot.seconds_of(line.image_times_ns[known]))
    way = np.concatenate([[0.0], np.cumsum(_steps(poses))])
    if way[-1] < _SHORTEST_WAY:
        return known[:0]
    places = np.linspace(0.0, way[-1], min(MOST_FRAMES, len(known)))
    middles = 0.5 * (way[1:] + way[:-1])
    return np.asarray(known[np.unique(np.searchsorted(middles, places))])


def _pauses(line: Timeline) -> bool:
    """Return whether the robot went from pause to pause, be they too few, and images show it."""
    resting = float(np.sum(line.pauses[:, 1] - line.pauses[:, 0])) / 1e9
    return line.stations >= _FEWEST_PAUSES or resting >= _RESTLESS * line.robot.seconds


def _image(name: str, frames: ImageFrames, line: Timeline, index: int) -> StationFrames:
    position, time = frames.positions[index], int(line.image_times_ns[index])
    return StationFrames(name, frames.decoder, (position,), time)


def _steps(poses: FloatArray) -> FloatArray:
    """Return how far (n, 4, 4) poses are from the ones before them, (n - 1,) in radians."""
    R, t = poses[:, :3, :3], poses[:, :3, 3]
    turned = rotations.angle(np.swapaxes(R[:-1], -1, -2) @ R[1:])
    moved = np.linalg.norm(np.diff(t, axis=0), axis=1)
    return np.asarray(turned + moved / _LEVER)


def _is_known(robot: RobotPath, times_ns: IntArray) -> NDArray[np.bool_]:
    """Return (n,) whether samples of the robot lie close on both sides of a time."""
    samples = robot.times_ns
    if len(samples) < 2:
        return np.zeros(len(times_ns), dtype=bool)
    gaps = np.diff(samples)
    longest = max(_LONGEST_STEP_NS, _LONGEST_STEP * float(np.median(gaps)))
    inside = (times_ns >= samples[0]) & (times_ns <= samples[-1])
    after = np.clip(np.searchsorted(samples, times_ns, side="right"), 1, len(samples) - 1)
    return np.asarray(inside & (gaps[after - 1] <= longest))
