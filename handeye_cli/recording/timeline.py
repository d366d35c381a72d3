"""Images, robot poses and pauses of a recording on one clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handeye_cli.geometry.trajectory import Trajectory
from handeye_cli.recording import clock
from handeye_cli.recording.clock import Clock
from handeye_cli.recording.options import McapOptions
from handeye_cli.recording.pauses import find_pauses
from handeye_cli.recording.survey import ImageFrames
from handeye_cli.recording.transforms import Chain
from handeye_cli.records import Finding, FloatArray, IntArray


@dataclass(frozen=True)
class RobotPath:
    """The robot's poses, where all links of the chain are known.

    Attributes:
        times_ns: (n,) times.
        poses: (n, 4, 4) `base_T_gripper`.
    """

    times_ns: IntArray
    poses: FloatArray

    @property
    def seconds(self) -> float:
        """Time from the first pose to the last."""
        return float(self.times_ns[-1] - self.times_ns[0]) / 1e9 if len(self.times_ns) else 0.0

    @property
    def trajectory(self) -> Trajectory:
        """The same of one pose or more, in seconds since the first of them."""
        return Trajectory(self.seconds_of(self.times_ns), self.poses)

    def seconds_of(self, times_ns: IntArray) -> FloatArray:
        """Return (m,) times in seconds since the first pose."""
        return np.asarray((times_ns - self.times_ns[0]) / 1e9)


@dataclass(frozen=True)
class Timeline:
    """What happened when.

    Attributes:
        clock: Which times of the messages count.
        clock_finding: Why these are not their stamps, or None.
        image_times_ns: (n,) times of the images by that clock, with the offset.
        robot: Where the robot was.
        pauses: (m, 2) intervals [start, end) in which it stood still.
        images: For each pause the indices of the images in it.
    """

    clock: Clock
    clock_finding: Finding | None
    image_times_ns: IntArray
    robot: RobotPath
    pauses: IntArray
    images: tuple[IntArray, ...]

    @property
    def stations(self) -> int:
        """Number of pauses with an image."""
        return sum(1 for group in self.images if len(group))


def timeline(frames: ImageFrames, chain: Chain, options: McapOptions) -> Timeline:
    """Put images and robot poses on one clock, and find the robot's pauses.

    Args:
        frames: The images.
        chain: The links from the robot's base to its gripper, one of which moves.
        options: The offset between the two, and when the robot counts as standing still.
    """
    source, finding = clock.choose(
        frames.stamps_ns,
        frames.log_times_ns,
        np.concatenate([link.stamps_ns for link in chain.dynamic]),
        np.concatenate([link.log_times_ns for link in chain.dynamic]),
    )
    times = frames.times_ns(source) + options.time_offset_ns
    robot = _robot_path(chain, source)
    pauses = find_pauses(robot.times_ns, robot.poses, options.pauses)
    images = tuple(np.flatnonzero((times >= start) & (times < end)) for start, end in pauses)
    return Timeline(source, finding, times, robot, pauses, images)


def _robot_path(chain: Chain, source: Clock) -> RobotPath:
    times_ns = chain.sample_times_ns(source)
    poses, known = chain.at(times_ns, source)
    return RobotPath(times_ns[known], poses[known])
