"""A recorded way through poses: where a frame was, and how fast it moved, at any time between.

Between two samples the translation goes straight and the rotation along the shorter arc, both at a
constant rate. Nothing is extrapolated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations, se3

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_FEWEST_FOR_NOISE = 5
_MEDIAN_TO_SIGMA = 1.4826
_HALF_WINDOW = 0.025
"""Seconds to each side over which a velocity is taken: that of neighbouring samples would be mostly
their noise."""


def between(start: FloatArray, end: FloatArray, share: FloatArray) -> FloatArray:
    """Return the (..., 4, 4) poses on the way between others.

    Args:
        start: (..., 4, 4) poses at share 0.
        end: (..., 4, 4) poses at share 1.
        share: (...) from 0 to 1.
    """
    share = np.asarray(share)[..., None]
    R0, R1 = start[..., :3, :3], end[..., :3, :3]
    turn = rotations.log(np.swapaxes(R0, -1, -2) @ R1)
    t0, t1 = start[..., :3, 3], end[..., :3, 3]
    return se3.from_parts(R0 @ rotations.exp(share * turn), t0 + share * (t1 - t0))


@dataclass(frozen=True)
class Trajectory:
    """Poses of a frame that moves.

    Attributes:
        times: (n,) strictly increasing seconds, n at least 1.
        poses: (n, 4, 4) parent_T_child.
    """

    times: FloatArray
    poses: FloatArray

    def covers(self, times: FloatArray) -> BoolArray:
        """Return (...) whether times in seconds lie between the first and the last sample."""
        return np.asarray((times >= self.times[0]) & (times <= self.times[-1]))

    def at(self, times: FloatArray) -> FloatArray:
        """Return the (..., 4, 4) poses at (...) times; outside, that of the nearest end."""
        last = len(self.times) - 1
        before = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, last)
        after = np.minimum(before + 1, last)
        span = self.times[after] - self.times[before]
        share = (times - self.times[before]) / np.where(after > before, span, 1.0)
        return between(self.poses[before], self.poses[after], np.clip(share, 0.0, 1.0))

    def velocities(self, times: FloatArray) -> FloatArray:
        """Return the (..., 6) rates of perturbation in the parent frame, m/s and rad/s.

        Args:
            times: (...) seconds; a velocity at an end is that of the samples inside.
        """
        first, last = self.times[0], self.times[-1]
        begin = np.clip(times - _HALF_WINDOW, first, last)
        end = np.clip(times + _HALF_WINDOW, first, last)
        seconds = np.where(end > begin, end - begin, np.inf)
        return np.asarray(se3.difference(self.at(end), self.at(begin)) / seconds[..., None])

    def velocity_noise(self) -> FloatArray:
        """Return (6,) by how much a velocity is off by the scatter of the samples, RMS per axis.

        What scatters from one sample to the next is told from a smooth motion by third differences,
        whose variance is that of twenty independent samples.
        """
        if len(self.times) < _FEWEST_FOR_NOISE:
            return np.zeros(6)
        steps = se3.difference(self.poses[1:], self.poses[:-1])
        third = np.abs(steps[2:] - 2.0 * steps[1:-1] + steps[:-2])
        sigma = _MEDIAN_TO_SIGMA * np.median(third, axis=0) / math.sqrt(20.0)
        return np.asarray(sigma * math.sqrt(2.0) / (2.0 * _HALF_WINDOW))
