"""Maximum likelihood with the free directions held, whatever is free.

What is free depends on the noise, the noise on the residuals, and these on the solution: the three
are found in turns until they agree.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.diagnosis.held_noise import held_noise, largest_covariance, rough_covariance
from handeye_cli.geometry import se3
from handeye_cli.geometry.free_directions import (
    NOTHING_DETERMINED,
    Freedom,
    fewest_free,
    free_directions,
)
from handeye_cli.geometry.gauge import at_gauge, gauge_step
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.geometry.loop_start import close_loops
from handeye_cli.geometry.whitened_loop import WhitenedLoops, least_squares, whiten
from handeye_cli.noise_levels import NoiseModel
from handeye_cli.records import FloatArray, Noise
from handeye_cli.solvers.problem import Solution

_ROUNDS = 30
_SETTLED = 1e-3
"""Change of the noise, in its own standard deviations, at which noise and answer agree."""
_MAX_STEPS = 50
_TOLERANCE = 1e-10
"""Largest step, in standard deviations of the unknowns, at which the iteration has settled."""
_SMALLEST = 1e-13
"""Step in radians and metres that is mere rounding."""
_FARTHEST = 10.0
"""Step, in the size of the robot's cell and in radians, that leads nowhere."""
_UNDECIDED = 3
"""Rounds after which what was once found free stays so."""


@dataclass(frozen=True)
class HeldEstimate:
    """The answer with its free directions held.

    Attributes:
        solution: X and Z.
        model: The noise of the stations' poses.
        free: What is held.
        converged: Whether solution, noise and freedom agree.
    """

    solution: Solution
    model: NoiseModel
    free: Freedom
    converged: bool


def estimate_held(
    chain: Chain,
    given: Noise | None,
    *,
    near: FloatArray | None = None,
    least: tuple[int, int] = (0, 0),
) -> HeldEstimate:
    """Estimate the determined part of the answer, its noise, and what is free.

    Args:
        chain: One station or more.
        given: Noise levels that are taken as given.
        near: (4, 4) guess of X that tells where the free directions are held; the identity when not
            given.
        least: Rotations and translations that are free in any case.

    Raises:
        UndeterminedError: So few stations that no residual is left to estimate their noise from.
    """
    near = np.eye(4) if near is None else near
    least = _more(least, fewest_free(len(chain.A)))
    solution = Solution(*close_loops(chain.A, chain.B))
    free = _judged(chain, solution, rough_covariance(chain, solution, least), least)
    model = held_noise(chain, given, solution, free)
    for turn in range(_ROUNDS):
        before, free = free, _judged(chain, solution, largest_covariance(chain, model), least)
        solution = _minimise(chain, model.covariance, solution, free, near)
        previous, model = model, held_noise(chain, given, solution, free, model.noise)
        if free.counts == before.counts and _settled(previous, model):
            return HeldEstimate(solution, model, free, solution.converged)
        if turn >= _UNDECIDED:
            least = _more(least, free.counts)
    return HeldEstimate(solution, model, free, converged=False)


def _more(first: tuple[int, int], second: tuple[int, int]) -> tuple[int, int]:
    return max(first[0], second[0]), max(first[1], second[1])


def _judged(
    chain: Chain, solution: Solution, covariance: FloatArray, least: tuple[int, int]
) -> Freedom:
    if least == NOTHING_DETERMINED.counts:
        return NOTHING_DETERMINED
    loops = linearised(chain, solution, covariance)
    return free_directions(loops, covariance, A=chain.A, X=solution.X, B=chain.B, least=least)


def linearised(chain: Chain, solution: Solution, covariance: FloatArray) -> WhitenedLoops:
    """Return the loops of a chain at a solution, of unit weights.

    Args:
        chain: N stations.
        solution: Where to linearise.
        covariance: (N, 12, 12) of the stations' poses.
    """
    return whiten(loop_jacobians(chain.A, chain.B, solution.X, solution.Z), covariance)


def _settled(before: NoiseModel, after: NoiseModel) -> bool:
    change = after.variances - before.variances
    return bool(change @ after.information @ change <= _SETTLED**2)


def _minimise(
    chain: Chain, covariance: FloatArray, start: Solution, free: Freedom, near: FloatArray
) -> Solution:
    """Minimise the weighted squares of the loops with the free directions held near a guess.

    What is judged free may be no more than weak; then the loops do not close far from the best fit,
    and steps can lead anywhere. The start is returned in that case, as not converged.
    """
    reach = _FARTHEST * (1.0 + float(np.max(np.abs(chain.A[:, :3, 3]))))
    X, Z = start.X, start.Z
    if any(free.counts):
        X, Z = at_gauge(chain.A, chain.B, X, near, free)
    for _ in range(_MAX_STEPS):
        loops = linearised(chain, Solution(X, Z), covariance)
        fixed = gauge_step(X, near, free)
        step, _ = least_squares(loops, free.basis, fixed)
        if not np.max(np.abs(step)) < reach:
            return replace(start, converged=False)
        X, Z = se3.perturb(X, step[:6]), se3.perturb(Z, step[6:])
        length = float(np.linalg.norm(loops.design @ step))
        moved = float(np.max(np.abs(fixed)))
        if moved < _SMALLEST and (length < _TOLERANCE or np.max(np.abs(step)) < _SMALLEST):
            return Solution(X, Z)
    return Solution(X, Z, converged=length < 1e-3 and moved < 1e-6)
