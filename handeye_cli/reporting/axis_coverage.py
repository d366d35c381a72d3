"""Which way the camera was turned between stations: the axes that the answer hangs on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations
from handeye_cli.geometry.star import all_pairs
from handeye_cli.records import FloatArray
from handeye_cli.reporting.case import Case

_MOST = 60
"""Stations of which all pairs are shown; of more, evenly chosen ones."""
_LEAST = 1e-6
"""Angle in radians below which a rotation has no axis."""


@dataclass(frozen=True)
class AxisCoverage:
    """Axes of interstation rotations of the mount, on the disc that a hemisphere becomes.

    The projection keeps areas; an axis and its opposite are the same, so a hemisphere holds all.

    Attributes:
        frame: The frame the axes are in, `gripper` or `base`: z is in the middle, x to the right.
        places: (m, 2) on a disc of radius 1.
        angles: (m,) of the rotations, radians.
        chosen: (m,) whether it is one of the pairs of the answer.
    """

    frame: str
    places: FloatArray
    angles: FloatArray
    chosen: NDArray[np.bool_]


def axis_coverage(case: Case) -> AxisCoverage | None:
    """Return the axes of a case, or None with fewer than two usable stations."""
    stations = case.stations
    if stations is None:
        return None
    left_out = {each.name for each in case.calibration.stations if not each.used} if (
        case.calibration
    ) else set()  # fmt: skip
    usable = [
        each
        for each in stations.stations
        if each.camera_T_target is not None and each.name not in left_out
    ]
    if len(usable) < 2:
        return None
    picked = np.unique(np.linspace(0, len(usable) - 1, _MOST).round().astype(int))
    robot = np.stack([usable[i].base_T_gripper[:3, :3] for i in picked])
    eye_in_hand = stations.setup is Setup.EYE_IN_HAND
    R = robot if eye_in_hand else np.swapaxes(robot, -1, -2)
    pairs = all_pairs(len(picked))
    turns = rotations.log(np.swapaxes(R[pairs[:, 1]], -1, -2) @ R[pairs[:, 0]])
    angles = np.linalg.norm(turns, axis=-1)
    turned = angles > _LEAST
    return AxisCoverage(
        frame=stations.setup.mount,
        places=on_disc(turns[turned] / angles[turned, None]),
        angles=angles[turned],
        chosen=_chosen([usable[i].name for i in picked], pairs, case)[turned],
    )


def on_disc(axes: FloatArray) -> FloatArray:
    """Return (n, 2) places on the unit disc for (n, 3) unit axes (Lambert's equal-area map)."""
    upper = np.where(axes[:, 2:] < 0.0, -axes, axes)
    return np.asarray(upper[:, :2] / np.sqrt(1.0 + upper[:, 2:]))


def _chosen(names: list[str], pairs: NDArray[np.int64], case: Case) -> NDArray[np.bool_]:
    answer = case.calibration
    if answer is None:
        return np.zeros(len(pairs), dtype=bool)
    of = [each.name for each in answer.stations]
    wanted = {frozenset((of[i], of[j])) for i, j in answer.pairs}
    return np.array([frozenset((names[i], names[j])) in wanted for i, j in pairs])
