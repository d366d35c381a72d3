"""Bad stations whose images belong to each other's robot poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handeye_cli.diagnosis.robust_fit import MOST_FREEDOM, Agreement
from handeye_cli.geometry.block_loop import predicted
from handeye_cli.records import FloatArray, IntArray

_FITS = 1e-3
"""Chance below which an image does not fit a robot pose."""
_MOST = 60
"""Bad stations that are tried with one another, at most."""


def mispaired(agreed: Agreement, turns: FloatArray | None = None) -> tuple[tuple[int, ...], ...]:
    """Return the cycles of stations that fit once their images are passed on.

    Args:
        agreed: The stations that agree; images and poses of the others are tried with one another.
        turns: (m, 4, 4) motions of the target after which it looks as before: which of them an
            image shows was decided with the wrong robot pose. None where there are none.

    Returns:
        Rows; the image of each belongs to the robot pose of the next, the last one's to that of the
        first. A pair is exchanged.
    """
    bad = np.flatnonzero(~agreed.rows)
    if not 2 <= len(bad) <= _MOST:
        return ()
    camera, robot = (grid.ravel() for grid in np.meshgrid(bad, bad, indexing="ij"))
    looks = np.eye(4)[None] if turns is None else turns
    chances = np.max([_chances(agreed, robot, camera, look) for look in looks], axis=0)
    chances = chances.reshape(len(bad), len(bad))
    belongs = np.where(chances.max(axis=1) > _FITS, np.argmax(chances, axis=1), -1)
    return tuple(tuple(bad[cycle].tolist()) for cycle in _cycles(belongs))


def _chances(agreed: Agreement, robot: IntArray, camera: IntArray, turn: FloatArray) -> FloatArray:
    """Return how likely images, of a target turned so, are those of robot poses."""
    pairs = agreed.loops.paired(robot, camera)
    turned = replace(pairs, B=pairs.B @ turn)
    return predicted(turned, agreed.found).chances(MOST_FREEDOM)


def _cycles(following: IntArray) -> list[list[int]]:
    """Return the cycles of two and more among n things, each of which points to one or to -1."""
    cycles, seen = [], set()
    for first in range(len(following)):
        path = [first]
        while (after := int(following[path[-1]])) >= 0 and after not in path:
            path.append(after)
        if after == first and len(path) > 1 and first not in seen:
            cycles.append(path)
            seen.update(path)
    return cycles
