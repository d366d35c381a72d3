"""Finding the pauses of a robot in its poses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from handeye_cli.recording.options import PauseThresholds
from handeye_cli.records import FloatArray, IntArray

BoolArray = NDArray[np.bool_]

_SAMPLES_PER_SIDE = 5
_SHORTEST_SIDE_NS = 100_000_000
_LONGEST_SIDE_NS = 250_000_000
"""The speed at a sample compares the means of the poses on its two sides; a side has about this
many samples, within these durations, but always reaches the next sample."""
_GAP_PERIODS = 3
"""A silence of up to this many sampling periods is none."""


def find_pauses(times_ns: IntArray, poses: FloatArray, thresholds: PauseThresholds) -> IntArray:
    """Return the intervals in which a robot stands still.

    The speed at a sample is the difference of the mean poses just after and just before it, which
    scatters much less than that of neighbouring samples. The ends of a pause within about 0.1 s of
    a motion are left out with it, and with them most of the vibration after a stop.

    Args:
        times_ns: (n,) strictly increasing times.
        poses: (n, 4, 4) poses of the gripper in the base, metres.
        thresholds: When the robot counts as standing still.

    Returns:
        (m, 2) intervals [start, end) in nanoseconds, in order of time.
    """
    if len(times_ns) < 2:
        return np.empty((0, 2), dtype=np.int64)
    motion = _Motion(times_ns, poses)
    first, last = _runs(_is_still(motion, thresholds), _gaps(times_ns, thresholds))
    keep = times_ns[last] - times_ns[first] >= thresholds.min_duration_ns
    first, last = first[keep], last[keep]
    middle = (first + last + 1) // 2
    drift, turn = motion.way(first, middle, middle, last + 1)
    steady = (drift <= thresholds.drift) & (turn <= thresholds.turn)
    return np.stack([times_ns[first[steady]], times_ns[last[steady]] + 1], axis=1)


class _Motion:
    """Means of poses over stretches of samples, from cumulative sums.

    The Frobenius norm of the difference of two rotation matrices is sqrt(2) times the angle between
    them while that is small, so the means of the matrices' elements give the rotation's speed.
    """

    def __init__(self, times_ns: IntArray, poses: FloatArray) -> None:
        self.times_ns = times_ns
        elements = poses[:, :3, :3].reshape(-1, 9) / np.sqrt(2.0)
        seconds = (times_ns - times_ns[0]) / 1e9
        values = np.concatenate([seconds[:, None], poses[:, :3, 3], elements], axis=1)
        self._origin = values.mean(axis=0)
        self._sums = np.zeros((len(values) + 1, values.shape[1]))
        np.cumsum(values - self._origin, axis=0, out=self._sums[1:])

    def _mean(self, start: IntArray, stop: IntArray) -> FloatArray:
        total = self._sums[stop] - self._sums[start]
        return np.asarray(total / np.maximum(stop - start, 1)[:, None])

    def way(
        self, start0: IntArray, stop0: IntArray, start1: IntArray, stop1: IntArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return distances and angles between the mean poses of pairs of stretches."""
        change = self._mean(start1, stop1) - self._mean(start0, stop0)
        return np.linalg.norm(change[:, 1:4], axis=1), np.linalg.norm(change[:, 4:], axis=1)

    def speeds(self) -> tuple[FloatArray, FloatArray]:
        """Return the (n,) speeds in m/s and rad/s; infinite for a sample without neighbours."""
        times, here = self.times_ns, np.arange(len(self.times_ns))
        period = float(np.median(np.diff(times)))
        side = np.clip(_SAMPLES_PER_SIDE * period, _SHORTEST_SIDE_NS, _LONGEST_SIDE_NS)
        reach = int(max(side, 1.5 * period))
        left = np.searchsorted(times, times - reach)
        right = np.searchsorted(times, times + reach, side="right")
        distance, angle = self.way(left, here + 1, here, right)
        seconds = self._mean(here, right)[:, 0] - self._mean(left, here + 1)[:, 0]
        alone = right - left == 1
        seconds = np.where(alone, 1.0, seconds)
        return (
            np.where(alone, np.inf, distance / seconds),
            np.where(alone, np.inf, angle / seconds),
        )


def _is_still(motion: _Motion, thresholds: PauseThresholds) -> BoolArray:
    speed, turn_rate = motion.speeds()
    slow = speed <= _limit(speed, thresholds.speed, thresholds.relative)
    return np.asarray(
        slow & (turn_rate <= _limit(turn_rate, thresholds.turn_rate, thresholds.relative))
    )


def _limit(speeds: FloatArray, floor: float, relative: float) -> float:
    """Return the largest speed of a pause: the floor, or a fraction of the typical speed."""
    moving = speeds[np.isfinite(speeds) & (speeds > floor)]
    return max(floor, relative * float(np.median(moving))) if len(moving) else floor


def _gaps(times_ns: IntArray, thresholds: PauseThresholds) -> BoolArray:
    """Return (n - 1,) whether too long a silence follows a sample."""
    steps = np.diff(times_ns)
    return np.asarray(steps > max(thresholds.max_gap_ns, _GAP_PERIODS * float(np.median(steps))))


def _runs(still: BoolArray, gap_after: BoolArray) -> tuple[IntArray, IntArray]:
    """Return the indices of the first and of the last samples of runs without a gap."""
    joined = still[1:] & still[:-1] & ~gap_after
    first = np.flatnonzero(still & ~np.concatenate([[False], joined]))
    last = np.flatnonzero(still & ~np.concatenate([joined, [False]]))
    return first, last
