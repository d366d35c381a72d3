"""Orders the points of a plate that looks the same after a turn consistently over the stations.

A detector cannot know which corner of a plain 6x6 plate is the first. Read differently in two
images, the plate seems to have been turned between them; the robot's rotations tell otherwise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from handeye_cli import robot_readings
from handeye_cli.geometry import se3
from handeye_cli.geometry.plate_turns import plate_turns
from handeye_cli.intrinsics import camera_or_calibrated
from handeye_cli.records import Features, FloatArray, IntArray, Station
from handeye_cli.views import Views, pose_candidates, views_of


def order_consistently(
    features: Features, points: FloatArray, turns: Sequence[IntArray]
) -> Features:
    """Renumber the points of each station so that all stations mean the same points.

    Args:
        features: Stations whose points are numbered up to one of the turns.
        points: (n, 3) points of the target in metres.
        turns: Permutations of the point indices, the identity first: a point that was called k
            may as well be point `turn[k]`.

    Returns:
        The features with consistent ids; the first station that was found keeps its own.
    """
    views = views_of(features.stations, points)
    if len(turns) < 2 or len(views.index) < 2:
        return features
    camera = camera_or_calibrated(features, views)
    flips = pose_candidates(views, camera)
    turned = se3.inverse(plate_turns(points, turns))
    count = len(views.index)
    poses = (flips.poses[:, None] @ turned[None, :, None]).reshape(count, -1, 4, 4)
    penalties = np.repeat(flips.penalties[:, None], len(turns), axis=1).reshape(count, -1)
    robot = views.reference_R_mount(features.setup)
    choice = robot_readings.choose(robot, poses[..., :3, :3], penalties)
    chosen = choice.index // flips.poses.shape[1]
    return replace(features, stations=_renumbered(features.stations, views, turns, chosen))


def _renumbered(
    stations: Sequence[Station], views: Views, turns: Sequence[IntArray], chosen: IntArray
) -> tuple[Station, ...]:
    out = list(stations)
    home = np.argsort(turns[chosen[0]])
    for index, turn in zip(views.index, chosen, strict=True):
        seen = out[index].observation
        if seen is None:
            continue
        ids = home[turns[turn][seen.ids]]
        order = np.argsort(ids)
        kept = replace(seen, ids=ids[order], pixels=seen.pixels[order])
        out[index] = replace(out[index], observation=kept)
    return tuple(out)
