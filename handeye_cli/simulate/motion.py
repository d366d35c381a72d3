"""The robot's way through its stations: a pause at each, a smooth motion to the next.

A place on the way is a number: 2.0 is station 2, 2.25 a quarter of the way from it to station 3.
Along the way a pose goes straight and turns about one axis. The share of a motion that is done is
the fifth-degree polynomial without speed and acceleration at both ends, whose largest speed is
15/8 of the mean.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from handeye_cli.errors import UsageError
from handeye_cli.geometry import rotations, se3
from handeye_cli.records import FloatArray, IntArray

Route = Callable[[FloatArray], FloatArray]
"""From (m,) places to the (m, 4, 4) poses there."""

SECOND_NS = 1_000_000_000
_PEAK = 15.0 / 8.0
_STEPS = 32
"""Parts of each motion whose speeds are compared with the limits."""
_MOST_TICKS = 10_000_000
"""As many times as memory surely holds."""
_SHORTEST_S = 0.3
"""Even a robot that hardly moves takes this long."""


@dataclass(frozen=True)
class SpeedLimits:
    """How fast a robot may go.

    Attributes:
        speed: Metres per second.
        turn_rate: Radians per second.
    """

    speed: float = 0.25
    turn_rate: float = 1.0


@dataclass(frozen=True)
class Timetable:
    """When the robot is where.

    Attributes:
        arrivals_ns: (N,) times at which it comes to rest at each station.
        departures_ns: (N,) times at which it goes on; the last is the end.
    """

    arrivals_ns: IntArray
    departures_ns: IntArray

    def places(self, times_ns: IntArray) -> FloatArray:
        """Return the (m,) places at (m,) times: whole numbers, exactly, during the pauses."""
        last = len(self.arrivals_ns) - 1
        station = np.clip(np.searchsorted(self.arrivals_ns, times_ns, "right") - 1, 0, last)
        leave, arrive = self.departures_ns[station], self.arrivals_ns[np.minimum(station + 1, last)]
        share = np.clip((times_ns - leave) / np.maximum(arrive - leave, 1), 0.0, 1.0)
        return np.where(station == last, last, station + _smooth(share))

    def ticks(self, rate: float) -> IntArray:
        """Return the times from beginning to end at which something of this rate in Hz happens.

        Raises:
            UsageError: The rate is not above 0, or it happens too often to be listed.
        """
        if not rate > 0.0:
            raise UsageError(f"expected a rate above 0 Hz, found {rate:g} Hz")
        start, end = int(self.arrivals_ns[0]), int(self.departures_ns[-1])
        seconds = (end - start) / SECOND_NS
        count = int(seconds * rate) + 1
        if count > _MOST_TICKS:
            raise UsageError(
                f"expected a run of at most {_MOST_TICKS} pictures or poses, found {count}, which "
                f"is {seconds:g} s at {rate:g} Hz",
                hint="shorten the pauses, or lower the rate",
            )
        ticks = np.rint(np.arange(count) * (SECOND_NS / rate)).astype(np.int64)
        return np.asarray(start + ticks)


def timetable(
    route: Route, count: int, *, pause_ns: int, start_ns: int = 0, limits: SpeedLimits | None = None
) -> Timetable:
    """Return the fastest timetable that keeps the limits.

    Args:
        route: The robot's way; its poses are what is limited.
        count: Number of stations N.
        pause_ns: Length of the pause at each.
        start_ns: Time of the first arrival.
        limits: How fast the robot may go.

    Raises:
        UsageError: The pause or a limit is not above 0.
    """
    limits = limits or SpeedLimits()
    if min(pause_ns, limits.speed, limits.turn_rate) <= 0:
        raise UsageError(
            "expected a pause and speeds above 0, found "
            f"{pause_ns / SECOND_NS:g} s, {limits.speed:g} m/s and {limits.turn_rate:g} rad/s"
        )
    travel_ns = np.ceil(SECOND_NS * _travel_seconds(route, count, limits)).astype(np.int64)
    arrivals = start_ns + np.concatenate([[0], np.cumsum(pause_ns + travel_ns)])
    return Timetable(arrivals, arrivals + pause_ns)


def along(poses: FloatArray, places: FloatArray) -> FloatArray:
    """Return the (m, 4, 4) poses at (m,) places of the way through (N, 4, 4) poses."""
    first = np.clip(np.floor(places).astype(np.int64), 0, max(len(poses) - 2, 0))
    share = (places - first)[:, None]
    begin, end = poses[first], poses[np.minimum(first + 1, len(poses) - 1)]
    turn = rotations.log(np.swapaxes(begin[:, :3, :3], -1, -2) @ end[:, :3, :3])
    R = begin[:, :3, :3] @ rotations.exp(share * turn)
    t = (1.0 - share) * begin[:, :3, 3] + share * end[:, :3, 3]
    return se3.from_parts(R, t)


def _travel_seconds(route: Route, count: int, limits: SpeedLimits) -> FloatArray:
    places = np.arange((count - 1) * _STEPS + 1) / _STEPS
    poses = route(places)
    distance = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    R = poses[:, :3, :3]
    angle = rotations.angle(np.swapaxes(R[:-1], -1, -2) @ R[1:])
    steps = np.maximum(distance / limits.speed, angle / limits.turn_rate).reshape(-1, _STEPS)
    return np.asarray(np.maximum(_PEAK * _STEPS * steps.max(axis=1), _SHORTEST_S))


def _smooth(share: FloatArray) -> FloatArray:
    return np.asarray(share**3 * (10.0 - share * (15.0 - 6.0 * share)))
