"""Pattern search: minimise without derivatives, from many starts at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from handeye_cli.records import FloatArray

_SEED = 1
_SHRINK, _GROW = 0.6, 1.3


def minimise(
    merit: Callable[[FloatArray], FloatArray],
    start: FloatArray,
    steps: FloatArray,
    *,
    rounds: int = 60,
    finest: float = 1e-3,
) -> tuple[FloatArray, FloatArray]:
    """Walk to a minimum of a function that need be neither smooth nor finite.

    Every round tries steps along each coordinate, and in directions that change from round to
    round, which lead along the edge of what is allowed. The best is taken; where none is better,
    the steps become smaller. The directions are the same in every call.

    Args:
        merit: Values of (m, p) points, shape (m,); infinite where a point is not allowed.
        start: (s, p) points to start from.
        steps: (p,) first steps; a coordinate with a step of 0 stays.
        rounds: Most rounds.
        finest: Part of the first steps at which a start has settled.

    Returns:
        (s, p) points and (s,) their values, never worse than at the start.
    """
    rng = np.random.default_rng(_SEED)
    points, values = start.copy(), merit(start)
    scale = np.ones(len(start))
    for _ in range(rounds):
        walking = np.flatnonzero(scale > finest)
        if not len(walking):
            break
        tried = points[walking, None] + scale[walking, None, None] * _moves(steps, rng)
        found = merit(tried.reshape(-1, start.shape[1])).reshape(tried.shape[:2])
        best = np.argmin(found, axis=1)
        lowest = found[np.arange(len(walking)), best]
        better = lowest < values[walking]
        scale[walking] *= np.where(better, _GROW, _SHRINK)
        points[walking[better]] = tried[better, best[better]]
        values[walking[better]] = lowest[better]
    return points, values


def _moves(steps: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return the (6 p, p) moves: either way along the coordinates, and in 2 p more directions."""
    drawn = rng.normal(size=(2 * len(steps), len(steps)))
    drawn /= np.linalg.norm(drawn, axis=1, keepdims=True)
    ways = np.concatenate([np.eye(len(steps)), drawn])
    return np.asarray(np.concatenate([ways, -ways]) * steps)
