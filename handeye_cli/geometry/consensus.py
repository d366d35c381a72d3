"""Choosing among several possible target poses per station with the help of the robot's rotations.

A plate that looks the same after a turn, or that weak perspective leaves with two poses, gives each
station several candidate rotations. Only one choice agrees with one rotation from camera to mount
and one from target to reference: `A_i R_X B_ik = R_Z` for every station.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_SEEDS = 8
_REPEATED = 0.1
"""Worth of a seed for each time that one of its stations was used before."""
_POOL = 40
"""Stations that seeds are looked for among; more would cost memory and gain nothing."""
_SMALLEST_AREA = 1e-3
"""Smallest product of two turns in rad^2 whose axes are told apart."""
_ROUNDS = 3
_ANOTHER_ANSWER = 0.5
"""Hypotheses whose R_X differ by more than this angle in radians are different answers."""
_FIRST_SCALE = 0.05
_SMALLEST_SCALE = 2e-4
_CAP = 50.0
"""Largest squared misfit in units of the scale: one wrong station must not decide for the rest."""


@dataclass(frozen=True)
class Choice:
    """One candidate per station.

    Attributes:
        index: (N,) which candidate.
        margin: Chi-square by which the best of all other answers, with another R_X, fits worse;
            infinite where there is none.
        misfit: Median angle by which the stations disagree under it, radians; 0 where the robot did
            not decide.
    """

    index: IntArray
    margin: float
    misfit: float = 0.0


def choose(robot: FloatArray, candidates: FloatArray, penalties: FloatArray) -> Choice:
    """Choose one candidate per station so that all agree with the robot's rotations.

    Args:
        robot: (N, 3, 3) rotations reference_R_mount.
        candidates: (N, K, 3, 3) possible rotations camera_R_target.
        penalties: (N, K) chi-square by which each candidate fits its own image worse than the best;
            infinite for one that does not exist.

    Returns:
        The choice. A small margin means that rotations cannot exclude another one, as when a long
        lens lets all views be mirrored together. Where the robot does not turn enough to tell, the
        candidates are those that fit their images best.
    """
    best: IntArray = np.argmin(penalties, axis=1)
    seeds = _seed_triples(robot)
    if candidates.shape[1] == 1 or not seeds:
        return Choice(best, np.inf)
    found = [_from_seed(robot, candidates, penalties, triple) for triple in seeds]
    R_X, R_Z = (np.concatenate(parts) for parts in zip(*found, strict=True))
    scale = _FIRST_SCALE
    for _ in range(_ROUNDS):
        costs, choices, medians = _assign(robot, candidates, penalties, (R_X, R_Z), scale)
        leaders = _leaders(costs, R_X)
        common = [_common_rotations(robot, _pick(candidates, choices[i])) for i in leaders]
        more_X, more_Z = zip(*common, strict=True)
        R_X, R_Z = np.concatenate([R_X, more_X]), np.concatenate([R_Z, more_Z])
        scale = min(max(_SMALLEST_SCALE, 2.0 * float(medians[leaders[0]])), _FIRST_SCALE)
    costs, choices, medians = _assign(robot, candidates, penalties, (R_X, R_Z), scale)
    winner, *others = _leaders(costs, R_X)
    margin = float(costs[others[0]] - costs[winner]) if others else np.inf
    return Choice(choices[winner], margin, float(medians[winner]))


def _leaders(costs: FloatArray, R_X: FloatArray) -> list[int]:
    """Return the cheapest hypothesis, and the cheapest of those with another answer if any."""
    winner = int(np.argmin(costs))
    other = np.flatnonzero(rotations.angle(R_X @ R_X[winner].T) > _ANOTHER_ANSWER)
    return [winner] + ([int(other[np.argmin(costs[other])])] if other.size else [])


def _pick(candidates: FloatArray, choice: IntArray) -> FloatArray:
    return candidates[np.arange(len(candidates)), choice]


def _seed_triples(robot: FloatArray) -> list[tuple[int, int, int]]:
    """Triples of stations whose motions turn about well separated axes.

    Each station is used as seldom as possible, so that a wrong one spoils few of them.
    """
    pool = np.unique(np.linspace(0, len(robot) - 1, min(len(robot), _POOL)).astype(int))
    turns = rotations.log(np.swapaxes(robot[pool, None], -1, -2) @ robot[pool])
    areas = np.linalg.norm(np.cross(turns[:, :, None], turns[:, None]), axis=-1)
    areas = np.where(areas > _SMALLEST_AREA, areas, 0.0)
    used = np.zeros(len(pool))
    triples = []
    for _ in range(_SEEDS):
        often = used[:, None, None] + used[:, None] + used
        best = int(np.argmax(areas * _REPEATED**often))
        triple = np.unravel_index(best, areas.shape)
        if areas[triple] == 0.0:
            break
        areas[triple] = 0.0
        used[list(triple)] += 1.0
        first, second, third = (int(pool[i]) for i in triple)
        triples.append((first, second, third))
    return triples


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
    R_X = rotations.align(np.broadcast_to(turned, seen.shape), seen)
    return R_X, base @ R_X @ first[:, 0]


def _common_rotations(robot: FloatArray, chosen: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the R_X and R_Z that all chosen candidates support."""
    turned = rotations.log(np.swapaxes(robot[:-1], -1, -2) @ robot[1:])
    seen = rotations.log(chosen[:-1] @ np.swapaxes(chosen[1:], -1, -2))
    R_X = rotations.project_to_so3(np.einsum("mi,mj->ij", turned, seen))
    return R_X, rotations.mean(robot @ R_X @ chosen)


def _assign(
    robot: FloatArray,
    candidates: FloatArray,
    penalties: FloatArray,
    hypotheses: tuple[FloatArray, FloatArray],
    scale: float,
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return cost, choice (H, N) and median misfit in radians under each of H hypotheses."""
    R_X, R_Z = hypotheses
    left = robot @ R_X[:, None]
    trace = np.einsum("hnij,nkjl,hil->hnk", left, candidates, R_Z)
    squares = np.maximum(3.0 - trace, 0.0)  # 4 sin^2(angle / 2)
    costs = np.minimum(squares / scale**2, _CAP) + penalties
    choices: IntArray = np.argmin(costs, axis=2)
    misfit = np.take_along_axis(squares, choices[..., None], axis=2)[..., 0]
    return np.sum(np.min(costs, axis=2), axis=1), choices, np.sqrt(np.median(misfit, axis=1))
