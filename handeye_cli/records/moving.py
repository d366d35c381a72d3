"""Frames that were taken while a robot moved, and the time between them and its poses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from handeye_cli.geometry.trajectory import Trajectory
from handeye_cli.records.basics import FloatArray, IntArray

if TYPE_CHECKING:
    from handeye_cli.records.line import RecordedStation


@dataclass(frozen=True)
class MovingFrames:
    """Some frames along the way of a robot, and that way.

    Attributes:
        frames: N of them in the order of their times, with the robot's poses at these.
        times: (N,) seconds by the robot's clock, as far as it is known: `given` is in them.
        path: `base_T_gripper` by that clock.
        stations: (n,) which of them are the recording's stations, for want of pauses; n is 0 where
            the pauses are.
        given: Seconds that were added to the images' own times.
    """

    frames: tuple[RecordedStation, ...]
    times: FloatArray
    path: Trajectory
    stations: IntArray
    given: float = 0.0

    @property
    def are_stations(self) -> bool:
        """Whether the recording's stations are among them."""
        return len(self.stations) > 0


@dataclass(frozen=True)
class TimeOffset:
    """The time between the images and the robot's poses of a recording.

    Attributes:
        offset: Seconds to add to the images' own times; below 0 where they are stamped too late.
        sigma: Its standard deviation, seconds.
        jitter: Standard deviation of a single image's time beside it, seconds.
        frames: Number of frames that it rests on.
        given: Seconds that were added already, as the user said.
    """

    offset: float
    sigma: float
    jitter: float
    frames: int
    given: float = 0.0
