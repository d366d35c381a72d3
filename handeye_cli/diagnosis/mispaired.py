"""Bad stations whose images belong to each other's robot poses."""

from __future__ import annotations

import numpy as np

from handeye_cli.diagnosis.robust_fit import MOST_FREEDOM, Agreement
from handeye_cli.geometry.block_loop import predicted
from handeye_cli.records import IntArray

_FITS = 1e-3
"""Chance below which an image does not fit a robot pose."""
_MOST = 60
"""Bad stations that are tried with one another, at most."""


def mispaired(agreed: Agreement) -> tuple[tuple[int, ...], ...]:
    """Return the cycles of stations that fit once their images are passed on.

    Args:
        agreed: The stations that agree; images and poses of the others are tried with one another.

    Returns:
        Rows; the image of each belongs to the robot pose of the next, the last one's to that of the
        first. A pair is exchanged.
    """
    bad = np.flatnonzero(~agreed.rows)
    if not 2 <= len(bad) <= _MOST:
        return ()
    camera, robot = (grid.ravel() for grid in np.meshgrid(bad, bad, indexing="ij"))
    others = predicted(agreed.loops.paired(robot, camera), agreed.found)
    chances = others.chances(MOST_FREEDOM).reshape(len(bad), len(bad))
    belongs = np.where(chances.max(axis=1) > _FITS, np.argmax(chances, axis=1), -1)
    return tuple(tuple(bad[cycle].tolist()) for cycle in _cycles(belongs))


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
