"""X and Z that nearly close the loops of any stations, also of those that leave directions free.

Closed forms need rotations about two axes. Here damped Gauss-Newton steps start from rotations
spread over all there are; the damping keeps the steps small along directions that nothing
determines, so neither a missing axis nor its noise does harm.
"""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations, se3, statistics
from handeye_cli.geometry.loop import loop_jacobians

FloatArray = NDArray[np.float64]

_STEPS_OF_ALL, _STEPS_OF_BEST = 5, 30
_STRONG, _MEDIUM, _WEAKEST = 1e-1, 1e-3, 1e-6
"""Damping, in the information that a station has on a well-determined direction: at the start of
all, at that of the best, and the least. What noise feigns is of the square of its radians."""
_RELIEF, _RETREAT = 0.2, 10.0
"""Factors on the damping after a step that has led nearer, and after one that has not."""
_SETTLED = 1e-3
"""Relative decrease of the squares at the weakest damping that leads nowhere any more."""
_NOTHING = 1e-24
"""Mean square that is rounding, in radians or in the camera's distance."""
_MOST_STATIONS = 40
"""Stations that the choice among the starts looks at."""


def close_loops(A: FloatArray, B: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return X and Z (4, 4) with `A_i X B_i` near Z for all stations.

    Args:
        A: (N, 4, 4) reference_T_mount, N >= 1.
        B: (N, 4, 4) camera_T_target.
    """
    length = max(statistics.median(np.linalg.norm(B[:, :3, 3], axis=1)), 1e-9)
    some = np.linspace(0, len(A) - 1, min(len(A), _MOST_STATIONS)).astype(int)
    X = se3.from_parts(_spread_rotations(), np.zeros(3))
    Z = se3.mean(A[some] @ X[:, None] @ B[some])
    unit = np.repeat([length, 1.0], 3)
    X, Z, cost = _damped_steps(A[some], B[some], X, Z, unit, damping=_STRONG, steps=_STEPS_OF_ALL)
    best = [np.argmin(cost)]
    X, Z, _ = _damped_steps(A, B, X[best], Z[best], unit, damping=_MEDIUM, steps=_STEPS_OF_BEST)
    return X[0], Z[0]


def _spread_rotations() -> FloatArray:
    """Return 40 rotations (40, 3, 3); every rotation is within 61 deg of one of them."""
    grid = np.array(list(product((-1.0, 0.0, 1.0), repeat=4)))
    return rotations.matrix_from_quaternion(grid[len(grid) // 2 + 1 :])


class _Place(NamedTuple):
    """Where K searches stand.

    Attributes:
        X: (K, 4, 4).
        Z: (K, 4, 4).
        normal: (K, 12, 12) information of a station.
        gradient: (K, 12) of half the mean square.
        cost: (K,) mean squares.
    """

    X: FloatArray
    Z: FloatArray
    normal: FloatArray
    gradient: FloatArray
    cost: FloatArray


def _damped_steps(
    A: FloatArray,
    B: FloatArray,
    X: FloatArray,
    Z: FloatArray,
    unit: FloatArray,
    *,
    damping: float,
    steps: int,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Improve (K, 4, 4) starts by Levenberg's steps; return them with their (K,) mean squares.

    Args:
        A: (N, 4, 4).
        B: (N, 4, 4).
        X: (K, 4, 4) starts.
        Z: (K, 4, 4) starts.
        unit: (6,) metres and radians that weigh alike.
        damping: Of the first step.
        steps: How many at most.
    """
    place, strength = _place(A, B, X, Z, unit), np.full(len(X), damping)
    for _ in range(steps):
        damped = place.normal + strength[:, None, None] * np.eye(12)
        step = np.linalg.solve(damped, -place.gradient[..., None])[..., 0].reshape(-1, 2, 6) * unit
        X, Z = se3.perturb(place.X, step[:, 0]), se3.perturb(place.Z, step[:, 1])
        before, tried = place.cost, _place(A, B, X, Z, unit)
        nearer = tried.cost < before
        place = _Place(*(_chosen(nearer, *each) for each in zip(tried, place, strict=True)))
        level = (strength <= _WEAKEST) & (before - tried.cost <= _SETTLED * before + _NOTHING)
        if np.all(np.where(nearer, level, strength > _STRONG)):
            break
        strength = np.where(nearer, np.maximum(strength * _RELIEF, _WEAKEST), strength * _RETREAT)
    return place.X, place.Z, place.cost


def _chosen(first: NDArray[np.bool_], yes: FloatArray, no: FloatArray) -> FloatArray:
    """Return the rows of `yes` where (K,) `first` is true, and those of `no` elsewhere."""
    return np.where(first.reshape(-1, *(1,) * (yes.ndim - 1)), yes, no)


def _place(A: FloatArray, B: FloatArray, X: FloatArray, Z: FloatArray, unit: FloatArray) -> _Place:
    """Linearise the loops, in units that weigh alike, at (K, 4, 4) X and Z."""
    loop = loop_jacobians(A, B, X, Z)
    J, left = loop.by_unknowns * np.tile(unit, 2) / unit[:, None], loop.residuals / unit
    normal = np.einsum("knai,knaj->kij", J, J) / len(A)
    gradient = np.einsum("knai,kna->ki", J, left) / len(A)
    return _Place(X, Z, normal, gradient, np.mean(np.sum(left**2, axis=-1), axis=-1))
