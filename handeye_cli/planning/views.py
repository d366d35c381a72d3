"""Places of the camera as six numbers: where it stands about the aim point, and how it is turned.

A view is (tilt x, tilt y, roll, distance, aside x, aside y): the paper's C_0, straight above the
aim point, is turned rigidly about it by a rotation vector in the target's plane, stands at a
distance, is rolled about its own axis, and then looks aside by a second rotation vector.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from handeye_cli.geometry import rotations, se3
from handeye_cli.records import FloatArray

ROLL, DISTANCE = 2, 3
SIZE = 6
_RINGS = ((1.0, 12), (0.5, 8), (0.0, 1))
"""Tilts of the grid, as parts of the largest, and how many directions each has."""
_ROLL_STEP = np.radians(30.0)


def circle_views(angles: ArrayLike, distance: float, tilt: float) -> FloatArray:
    """Return the (N, 6) views of the paper's generator, section IV-A1.

    Args:
        angles: (N,) directions of the turning axes in the target's plane, radians from x.
        distance: From the camera to the aim point, metres.
        tilt: Angle of the turn, radians.
    """
    angles = np.asarray(angles, dtype=float)
    views = np.zeros((len(angles), SIZE))
    views[:, 0], views[:, 1] = tilt * np.cos(angles), tilt * np.sin(angles)
    views[:, DISTANCE] = distance
    return views


def cameras_of(views: FloatArray, aim: FloatArray) -> FloatArray:
    """Return the (..., 4, 4) poses target_T_camera of (..., 6) views of a (3,) aim point."""
    # one batch of the three rotations takes a third of the time of three
    turns = np.zeros((3, *views.shape[:-1], 3))
    turns[0, ..., :2], turns[1, ..., 2], turns[2, ..., :2] = (
        views[..., :2],
        views[..., ROLL],
        views[..., 4:],
    )
    tilted, rolled, aside = rotations.exp(turns)
    position = aim - views[..., DISTANCE, None] * tilted[..., :, 2]
    return se3.from_parts(tilted @ rolled @ aside, position)


def tilts(views: FloatArray) -> FloatArray:
    """Return the (...) angles between the line of sight to the aim and the target's normal."""
    return np.asarray(np.hypot(views[..., 0], views[..., 1]))


def rolls(views: FloatArray) -> FloatArray:
    """Return the (...) turns about the camera's own axis, as angles in [0, pi]."""
    return np.abs(np.arctan2(np.sin(views[..., ROLL]), np.cos(views[..., ROLL])))


def grid(tilt: float, roll: float, nearest: float, farthest: float) -> FloatArray:
    """Return (K, 6) views spread over what is within reach, those at the largest tilt first.

    Args:
        tilt: Largest tilt, radians.
        roll: Largest roll to either side, radians.
        nearest: Smallest distance from the aim, metres.
        farthest: Largest distance, metres.
    """
    rings = [
        circle_views(2.0 * np.pi * np.arange(n) / n, nearest, part * tilt) for part, n in _RINGS
    ]
    tilted = np.concatenate(rings)[:, :2]
    turns = int(roll / _ROLL_STEP + 1e-9)
    rolled = np.arange(-turns, turns + 1) * _ROLL_STEP
    if len(rolled) > 12:  # half a turn to the left is half a turn to the right
        rolled = rolled[1:]
    away = np.unique(np.geomspace(nearest, farthest, 3) if farthest > nearest else [nearest])
    index = np.indices((len(tilted), len(rolled), len(away))).reshape(3, -1)
    views = np.zeros((index.shape[1], SIZE))
    views[:, :2] = tilted[index[0]]
    views[:, ROLL], views[:, DISTANCE] = rolled[index[1]], away[index[2]]
    return views
