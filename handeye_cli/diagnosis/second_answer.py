"""A second answer that stations allow beside the one that was found.

The rotations of `A_i X B_i = Z` leave a sign open for every half turn: its axis may point either
way. If R X is an answer as well as X, then R leaves every motion of the mount what it is. So all
motions but half turns have R's axis, R is a half turn itself, and the half turns have axes along
R's or across it. What a translation along the axes of half turns is, tells the two apart; where the
camera turns about the target alone, there is none.
"""

from __future__ import annotations

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.geometry.observability import BoolArray, half_turns
from handeye_cli.geometry.tail_probabilities import f_tail
from handeye_cli.records import FloatArray
from handeye_cli.solvers.problem import Solution

_LARGEST_MISS = 0.6
"""Radians by which another answer's motions may miss before it is refined: twice a large noise."""
_SMALL = 0.05
"""Turns in radians whose axes are no help to find the one of another answer."""
_MOST_AXES = 8
"""Half turns among whose axes another answer's is looked for; more allow no other answer."""
_DISTINCT = 0.05
"""Sine of the angle between axes that are not the same."""
_STEPS = 6
_FLOOR = 1e-18
"""Mean square of residuals, rad^2 and m^2, that is mere rounding."""
_AS_LIKELY = 1e-4
"""Chance of residuals so much larger by noise alone, below which an answer is the worse one: who
takes the wrong one is off by a half turn, and is not told."""


def second_answer(chain: Chain, solution: Solution) -> Solution | None:
    """Return another answer that fits the stations as well as a given one, or None.

    Args:
        chain: Three stations or more, which turn about more than one axis.
        solution: The answer, roughly.
    """
    halves = half_turns(chain.A[0, :3, :3], chain.A[1:, :3, :3])
    if not halves.any():
        return None
    motions = np.swapaxes(chain.A[0, :3, :3], -1, -2) @ chain.A[1:, :3, :3]
    turns = rotations.exp(np.pi * _candidates(motions, halves))
    moved = turns[:, None] @ motions @ np.swapaxes(turns, -1, -2)[:, None]
    apart = rotations.angle(np.swapaxes(moved, -1, -2) @ motions).max(axis=1)
    possible = [row for row in np.argsort(apart, kind="stable") if apart[row] <= _LARGEST_MISS]
    if not possible:
        return None
    found = _refined(chain, solution.X)
    starts = (se3.from_parts(turns[row] @ solution.X[:3, :3], np.zeros(3)) for row in possible)
    others = (_refined(chain, start) for start in starts)
    return next((other for other in others if _as_likely(chain, found, other)), None)


def _candidates(motions: FloatArray, halves: BoolArray) -> FloatArray:
    """Return the (k, 3) axes about which another answer may be turned.

    The axis is that of all motions which are no half turns; if there are none, it is that of a half
    turn, or across two of them.
    """
    others = ~halves & (rotations.angle(motions) > _SMALL)
    P = rotations.principal_axis(motions)
    if others.any():
        return np.asarray(np.linalg.svd(P[others], full_matrices=False)[2][:1])
    units = P[halves][:_MOST_AXES] / np.linalg.norm(P[halves][:_MOST_AXES], axis=1, keepdims=True)
    first, second = np.triu_indices(len(units), 1)
    across = np.cross(units[first], units[second])
    sizes = np.linalg.norm(across, axis=1)
    distinct = sizes > _DISTINCT
    return np.concatenate([units, across[distinct] / sizes[distinct, None]])


def _refined(chain: Chain, X: FloatArray) -> Solution:
    """Return the poses near a rotation that close the loops best, by steps of Gauss and Newton.

    The first step finds the translations, which are linear; lengths count like the robot's reach.
    """
    Z = chain.A[0] @ X @ chain.B[0]
    reach = max(float(np.max(np.linalg.norm(chain.B[:, :3, 3], axis=1))), 1e-9)
    weights = np.repeat([1.0 / reach, 1.0], 3)[:, None]
    for _ in range(_STEPS):
        loops = loop_jacobians(chain.A, chain.B, X, Z)
        design = (weights * loops.by_unknowns).reshape(-1, 12)
        target = -(weights[:, 0] * loops.residuals).ravel()
        step = np.asarray(np.linalg.lstsq(design, target, rcond=None)[0], dtype=np.float64)
        X, Z = se3.perturb(X, step[:6]), se3.perturb(Z, step[6:])
    return Solution(X, Z)


def _as_likely(chain: Chain, solution: Solution, other: Solution) -> bool:
    """Return whether chance explains that another answer leaves larger residuals, if it does."""
    freedom = 3 * len(chain.A) - 6
    found, others = (_mean_squares(chain, each) for each in (solution, other))
    return all(
        f_tail(float(worse / better), freedom, freedom) > _AS_LIKELY
        for worse, better in zip(others + _FLOOR, found + _FLOOR, strict=True)
    )


def _mean_squares(chain: Chain, solution: Solution) -> FloatArray:
    """Return (2,) mean squares of the residuals in translation and in rotation."""
    residuals = loop_jacobians(chain.A, chain.B, solution.X, solution.Z).residuals
    return se3.by_kind(np.mean(residuals**2, axis=0))
