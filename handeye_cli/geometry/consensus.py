"""Choosing among several possible target poses per station with the help of the robot's rotations.

A plate that looks the same after a turn, or that weak perspective leaves with two poses, gives each
station several candidate rotations. Only one choice agrees with one rotation from camera to mount
and one from target to reference: `A_i R_X B_ik = R_Z` for every station.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_SEEDS = 6
_POOL = 40
"""Stations that seeds are looked for among; more would cost memory and gain nothing."""
_SMALLEST_AREA = 1e-3
"""Smallest product of two turns in rad^2 whose axes are told apart."""
_ROUNDS = 3
_FIRST_SCALE = 0.05
_SMALLEST_SCALE = 2e-4
_CAP = 50.0
"""Largest squared misfit in units of the scale: one wrong station must not decide for the rest."""


def choose(robot: FloatArray, candidates: FloatArray, penalties: FloatArray) -> IntArray:
    """Choose one candidate per station so that all agree with the robot's rotations.

    Args:
        robot: (N, 3, 3) rotations reference_R_mount.
        candidates: (N, K, 3, 3) possible rotations camera_R_target.
        penalties: (N, K) chi-square by which each candidate fits its own image worse than the best;
            infinite for one that does not exist.

    Returns:
        (N,) the index of the chosen candidate. Where the robot does not turn enough to tell, the
        candidate that fits its image best.
    """
    best: IntArray = np.argmin(penalties, axis=1)
    seeds = _seed_triples(robot)
    if candidates.shape[1] == 1 or not seeds:
        return best
    hypotheses = [_from_seed(robot, candidates, penalties, triple) for triple in seeds]
    scale = _FIRST_SCALE
    for _ in range(_ROUNDS):
        trials = [_assign(robot, candidates, penalties, h, scale) for h in hypotheses]
        _, choice, median = min(trials, key=lambda trial: trial[0])
        hypotheses = hypotheses[: len(seeds)]
        hypotheses.append(_common_rotations(robot, _pick(candidates, choice)))
        scale = min(max(_SMALLEST_SCALE, 2.0 * median), _FIRST_SCALE)
    return choice


def _pick(candidates: FloatArray, choice: IntArray) -> FloatArray:
    return candidates[np.arange(len(candidates)), choice]


def _seed_triples(robot: FloatArray) -> list[tuple[int, int, int]]:
    """Triples of stations whose motions turn about well separated axes, the best of each seed."""
    pool = np.unique(np.linspace(0, len(robot) - 1, min(len(robot), _POOL)).astype(int))
    turns = rotations.log(np.swapaxes(robot[pool, None], -1, -2) @ robot[pool])
    areas = np.linalg.norm(np.cross(turns[:, :, None], turns[:, None]), axis=-1)
    best = np.argmax(areas.reshape(len(pool), -1), axis=1)
    second, third = np.unravel_index(best, areas.shape[1:])
    size = areas[np.arange(len(pool)), second, third]
    order = np.argsort(-size, kind="stable")[:_SEEDS]
    return [
        (int(pool[seed]), int(pool[second[seed]]), int(pool[third[seed]]))
        for seed in order
        if size[seed] > _SMALLEST_AREA
    ]


def _from_seed(
    robot: FloatArray, candidates: FloatArray, penalties: FloatArray, triple: tuple[int, int, int]
) -> tuple[FloatArray, FloatArray]:
    """Return the (R_X, R_Z) hypotheses of every combination of the triple's candidates."""
    exists = [np.flatnonzero(np.isfinite(penalties[station])) for station in triple]
    combos = np.array(list(product(*exists)))
    chosen = candidates[np.array(triple)[None, :], combos]
    first = chosen[:, :1]
    seen = rotations.log(first @ np.swapaxes(chosen[:, 1:], -1, -2))
    base = robot[triple[0]]
    turned = rotations.log(np.swapaxes(base, -1, -2) @ robot[list(triple[1:])])
    R_X = align(np.broadcast_to(turned, seen.shape), seen)
    return R_X, base @ R_X @ first[:, 0]


def align(targets: FloatArray, sources: FloatArray) -> FloatArray:
    """Return the (..., 3, 3) rotations R that bring `R @ sources` nearest to `targets`.

    The cross product of the first two pairs is added as a third, so two vectors are enough.

    Args:
        targets: (..., m, 3) vectors, m >= 2.
        sources: (..., m, 3) vectors.
    """
    outer = np.einsum("...mi,...mj->...ij", targets, sources)
    normal_t = np.cross(targets[..., 0, :], targets[..., 1, :])
    normal_s = np.cross(sources[..., 0, :], sources[..., 1, :])
    return rotations.project_to_so3(outer + normal_t[..., :, None] * normal_s[..., None, :])


def _common_rotations(robot: FloatArray, chosen: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (R_X, R_Z) that all chosen candidates support, as a batch of one."""
    turned = rotations.log(np.swapaxes(robot[:-1], -1, -2) @ robot[1:])
    seen = rotations.log(chosen[:-1] @ np.swapaxes(chosen[1:], -1, -2))
    R_X = rotations.project_to_so3(np.einsum("mi,mj->ij", turned, seen))
    R_Z = rotations.mean(robot @ R_X @ chosen)
    return R_X[None], R_Z[None]


def _assign(
    robot: FloatArray,
    candidates: FloatArray,
    penalties: FloatArray,
    hypotheses: tuple[FloatArray, FloatArray],
    scale: float,
) -> tuple[float, IntArray, float]:
    """Return cost, choice and median misfit in radians under the best of a batch of hypotheses."""
    R_X, R_Z = hypotheses
    left = robot @ R_X[:, None]
    trace = np.einsum("hnij,nkjl,hil->hnk", left, candidates, R_Z)
    squares = np.maximum(3.0 - trace, 0.0)  # 4 sin^2(angle / 2)
    costs = np.minimum(squares / scale**2, _CAP) + penalties
    total = np.sum(np.min(costs, axis=2), axis=1)
    winner = int(np.argmin(total))
    choice = np.argmin(costs[winner], axis=1)
    misfit = np.sqrt(squares[winner, np.arange(len(robot)), choice])
    return float(total[winner]), choice, float(np.median(misfit))
