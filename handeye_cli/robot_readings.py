"""Choosing target poses by the robot's rotations, whatever convention these are written in.

Which way a plate is turned is decided before anybody has judged the conventions. Rotations that are
read in a wrong one would scramble the poses, and nothing could be told from them any more. So where
the declared reading fits badly and another one well, that one decides here; the verdict on it is
left to who solves.
"""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry import consensus, rotations
from handeye_cli.geometry.consensus import Choice
from handeye_cli.records import FloatArray

_NOISE = 0.04
"""Median disagreement in radians that a robot's noise explains."""
_MUCH_BETTER = 0.25
"""Share of the declared reading's disagreement that another one has to stay below."""


def choose(robot: FloatArray, candidates: FloatArray, penalties: FloatArray) -> Choice:
    """Choose one candidate per station so that all agree; see `consensus.choose`.

    Args:
        robot: (N, 3, 3) rotations reference_R_mount as declared.
        candidates: (N, K, 3, 3) possible rotations camera_R_target.
        penalties: (N, K) chi-square by which each fits its own image worse than the best.
    """
    declared = consensus.choose(robot, candidates, penalties)
    if declared.misfit <= _NOISE:
        return declared
    others = [consensus.choose(each, candidates, penalties) for each in _other_readings(robot)]
    best = min(others, key=lambda choice: choice.misfit)
    return best if best.misfit < _MUCH_BETTER * declared.misfit else declared


def _other_readings(robot: FloatArray) -> list[FloatArray]:
    """Return the rotations the other way round, and by quaternions in the other order."""
    inverse = np.swapaxes(robot, -1, -2)
    readings = [inverse]
    for R in (robot, inverse):
        q = rotations.quaternion_from_matrix(R)
        for places in (-1, 1):
            other = rotations.matrix_from_quaternion(np.roll(q, places, axis=-1))
            readings += [other, np.swapaxes(other, -1, -2)]
    return readings
