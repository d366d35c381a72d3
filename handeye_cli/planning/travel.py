"""The order in which the robot visits stations with the least motion."""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry import rotations
from handeye_cli.records import FloatArray

METRES_PER_RADIAN = 0.3
"""Travel that takes a robot about as long as a turn by one radian."""
MOST_POLISHED = 200
"""Of more stations, the nearest one that is left always comes next."""
_SECOND_STOPS = 12


def motions(poses: FloatArray) -> FloatArray:
    """Return the (N, N) motions between poses, in radians: turn, and travel at 0.3 m per radian.

    Args:
        poses: (N, 4, 4) poses of whatever moves.
    """
    q = rotations.quaternion_from_matrix(poses[:, :3, :3])
    turn = 2.0 * np.arccos(np.minimum(np.abs(q @ q.T), 1.0))
    t = poses[:, :3, 3]
    return np.asarray(turn + np.linalg.norm(t[:, None] - t, axis=-1) / METRES_PER_RADIAN)


def shortest_way(poses: FloatArray) -> list[int]:
    """Return an order of all stations with little motion between them, starting at the first.

    From each of several second stops, the nearest station that is left comes next; then parts of
    the way are reversed (2-opt) as long as that shortens it. The way is open: the robot need not
    come back.

    Args:
        poses: (N, 4, 4) poses of whatever moves.
    """
    cost = motions(poses)
    if len(cost) < 3 or len(cost) > MOST_POLISHED:
        return _nearest_first(cost, [0])
    seconds = np.argsort(cost[0, 1:], kind="stable")[:_SECOND_STOPS] + 1
    ways = [_reversed_parts(cost, _nearest_first(cost, [0, int(each)])) for each in seconds]
    return min(ways, key=lambda way: length(cost, way))


def length(cost: FloatArray, way: list[int]) -> float:
    """Return the length of a way over (N, N) motions."""
    return float(np.sum(cost[way[:-1], way[1:]]))


def _nearest_first(cost: FloatArray, begin: list[int]) -> list[int]:
    left, way = np.ones(len(cost), dtype=bool), list(begin)
    left[way] = False
    while np.any(left):
        way.append(int(np.argmin(np.where(left, cost[way[-1]], np.inf))))
        left[way[-1]] = False
    return way


def _reversed_parts(cost: FloatArray, way: list[int]) -> list[int]:
    order = np.array(way)
    # a last stop that is as near to every station makes the open way a tour
    open_end = np.pad(cost, (0, 1))
    while len(order) > 2:
        tour = np.append(order, len(cost))
        step = open_end[tour[:-1], tour[1:]]
        i, j = np.triu_indices(len(order), 1)
        i, j = i[i > 0], j[i > 0]
        after = open_end[tour[i - 1], tour[j]] + open_end[tour[i], tour[j + 1]]
        gain = step[i - 1] + step[j] - after
        best = int(np.argmax(gain))
        if gain[best] <= 1e-12:
            break
        order[i[best] : j[best] + 1] = order[i[best] : j[best] + 1][::-1].copy()
    return [int(each) for each in order]
