"""Turns after which a plate looks as it did before."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations, se3

FloatArray = NDArray[np.float64]


def plate_turns(points: FloatArray, turns: Sequence[NDArray[np.int64]]) -> FloatArray:
    """Return the motions of a plate that bring every point k to the place of point `turn[k]`.

    Args:
        points: (n, 3) points of the plate, in its own frame.
        turns: m permutations of the points.

    Returns:
        (m, 4, 4) motions in the plate's frame.
    """
    centre = points.mean(axis=0)
    plane = np.array([0.0, 0.0, np.max(np.abs(points - centre))])
    before = np.concatenate([points - centre, plane[None]])
    after = np.stack([np.concatenate([points[turn] - centre, plane[None]]) for turn in turns])
    R = rotations.align(after, np.broadcast_to(before, after.shape))
    return se3.from_parts(R, centre - R @ centre)
