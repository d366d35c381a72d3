"""Frames that seem to jump to and fro: two nodes tell different poses, or two times were mixed."""

from __future__ import annotations

import numpy as np

from handeye_cli.recording.transforms import Samples
from handeye_cli.records import FloatArray, IntArray

_LEAST = 10
_SHARE = 0.02
"""So many samples, and such a part of all, jump to and fro before a link is not believed."""
_FAR = 2e-3
"""Metres of a jump that noise does not explain; a radian counts as half a metre."""
_FASTEST = 50.0
"""Metres per second squared that no robot has."""
_BACK = 0.25
"""Part of a jump that may be left once it was undone."""


def jumps(samples: Samples) -> tuple[int, float]:
    """Return how many samples jump away and straight back, and how far they typically do.

    Args:
        samples: Cleaned samples of one link.

    Returns:
        Number of jumps, 0 where there are only few, and their median length in metres, in which a
        radian counts as half a metre.
    """
    times, places = _sorted(samples)
    steps, seconds = np.diff(places, axis=0), np.maximum(np.diff(times), 1) / 1e9
    lengths = np.linalg.norm(steps, axis=1)
    far = np.flatnonzero(lengths > _FAR)
    first, second = far[:-1], far[1:]
    undone = np.linalg.norm(steps[first] + steps[second], axis=1) <= _BACK * lengths[first]
    turn = np.linalg.norm(
        steps[first] / seconds[first, None] - steps[second] / seconds[second, None], axis=1
    )
    between = 0.5 * (times[second + 1] - times[first]) / 1e9
    wrong = lengths[first[undone & (turn > _FASTEST * between)]]
    if len(wrong) < max(_LEAST, _SHARE * len(places)):
        return 0, 0.0
    return len(wrong), float(np.median(wrong))


def _sorted(samples: Samples) -> tuple[IntArray, FloatArray]:
    """Return the (n,) times in their order, and (n, 7) places in metres."""
    times = samples.stamps_ns if samples.stamps_ns.all() else samples.log_times_ns
    order = np.argsort(times, kind="stable")
    t, q = samples.numbers[order, :3], samples.numbers[order, 3:]
    # of the two quaternions of a rotation the one near the one before it
    alike = np.sum(q[1:] * q[:-1], axis=1)
    signs = np.concatenate([[1.0], np.cumprod(np.where(alike < 0.0, -1.0, 1.0))])
    return times[order], np.concatenate([t, signs[:, None] * q], axis=1)
