"""Stations that make the answer as sure as the cell allows: exchange, then polish (A-optimal).

The figure to make small is the expected square of the answer's rotation error plus that of its
translation error, each in units of what the paper's layout gives. A station is worth

    tr W (I + W P W')^-1 W P^2, weighted

W being its whitened rows and P the covariance without it, so thousands of places cost one batch.
What errors that recorded poses share do to the answer, P g, follows P: `(P - P W' (...)^-1 W P) g`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from handeye_cli.errors import UndeterminedError
from handeye_cli.planning import views
from handeye_cli.planning.cell import Cell, Places
from handeye_cli.planning.pattern import minimise
from handeye_cli.planning.prediction import UncertainRig, covariance, information
from handeye_cli.planning.settle import nearest
from handeye_cli.records import FloatArray

_SWEEPS = 6
_WORTH_IT = 1e-3
"""Part of the figure that a sweep over all stations has to gain for another to follow."""
_PRIOR = np.eye(12)
"""Information of a metre and a radian: nothing beside a station, and two stations alone leave no
variance so large that differences of figures drown in rounding."""
_NEARLY = 0.05
"""Distance in the pattern search's steps at which a start of the polish has settled."""


@dataclass(frozen=True)
class Problem:
    """What a design minimises, and over what.

    Attributes:
        rig: Robot, camera and noise.
        cell: What is allowed.
        weights: (2,) of the squared rotation and translation error.
        recorded: (D, p, p) information of what was recorded already, on X, Z and, where intrinsics
            are uncertain, on these.
        free: (6,) first steps of the polish; 0 for what is not to be changed.
        pull: (p, q) of the errors that the recorded poses share; see `prediction.covariance`.
    """

    rig: UncertainRig
    cell: Cell
    weights: FloatArray
    recorded: FloatArray
    free: FloatArray
    pull: FloatArray = field(default_factory=lambda: np.zeros((12, 0)))

    def figure(self, gathered: FloatArray) -> float:
        """Return the figure for (D, p, p) information."""
        variances = np.einsum("dii->i", covariance(gathered, self.pull)[:, :6, :6]) / len(gathered)
        return float(variances @ self._per_axis)

    def with_one_more(self, gathered: FloatArray, rows: FloatArray) -> FloatArray:
        """Return the (K,) figures with one of K stations added.

        Args:
            gathered: (D, p, p) information of the others.
            rows: (D, K, r, p) whitened rows of the stations.
        """
        P = covariance(gathered)[:, None]
        spread = rows @ P
        seen = spread[..., :6] * np.sqrt(self._per_axis)
        inner = np.eye(rows.shape[-2]) + spread @ np.swapaxes(rows, -1, -2)
        both = np.linalg.solve(inner, np.concatenate([seen, spread @ self.pull], axis=-1))
        gain = np.einsum("dkij,dkij->k", seen, both[..., :6])
        before = np.sqrt(self._per_axis)[:, None] * (P @ self.pull)[..., :6, :]
        after = before - np.swapaxes(seen, -1, -2) @ both[..., 6:]
        gain += np.einsum("dkij->k", before**2) - np.einsum("dkij->k", after**2)
        return np.asarray(self.figure(gathered) - gain / len(rows))

    @property
    def _per_axis(self) -> FloatArray:
        return np.repeat(self.weights[::-1], 3)


def design(problem: Problem, count: int, grid: FloatArray, start: FloatArray | None) -> FloatArray:
    """Choose stations.

    Args:
        problem: What is minimised, and over what.
        count: Number of stations.
        grid: (K, 6) places to choose from.
        start: (count, 6) allowed places to compare with, or None; no worse design is returned.

    Returns:
        (count, 6) places, all allowed.

    Raises:
        UndeterminedError: No place, or not so many, are allowed.
    """
    choice = _choice(problem, grid)
    chosen = [_polished(problem, _greedy(problem, count, choice, grid), choice)]
    if start is not None:
        chosen.append(_polished(problem, start, choice))
    figures = [problem.figure(_gathered(problem, each)) for each in chosen]
    return chosen[int(np.argmin(figures))]


@dataclass(frozen=True)
class _Choice:
    """K places that are allowed by themselves, with their (D, K, r, p) whitened rows."""

    places: Places
    rows: FloatArray

    def figures(self, problem: Problem, others: FloatArray) -> FloatArray:
        """Return the (K,) figures with one of them beside others; infinite where not allowed."""
        turned = problem.cell.places(others).turned
        broken = np.any(problem.cell.excess_beside(self.places, turned) > 0.0, axis=1)
        values = problem.with_one_more(_gathered(problem, others), self.rows)
        return np.where(broken, np.inf, values)


def _choice(problem: Problem, grid: FloatArray) -> _Choice:
    places = problem.cell.places(grid)
    allowed = np.flatnonzero(np.all(problem.cell.excess_alone(places) == 0.0, axis=1))
    places = places.part(allowed)
    return _Choice(places, problem.rig.rows(places.cameras))


def _gathered(problem: Problem, at: FloatArray) -> FloatArray:
    rows = problem.rig.rows(problem.cell.cameras_of(at))
    others = problem.recorded.shape[-1] - len(_PRIOR)
    return np.asarray(problem.recorded + np.pad(_PRIOR, (0, others)) + information(rows))


def _greedy(problem: Problem, count: int, choice: _Choice, grid: FloatArray) -> FloatArray:
    """Return stations taken one after the other, each the best beside those before it."""
    chosen = np.zeros((0, views.SIZE))
    for _ in range(count):
        values = choice.figures(problem, chosen)
        if len(values) and np.min(values) < np.inf:
            best = choice.places.views[int(np.argmin(values))]
        else:
            best = _any_place(problem, chosen, grid, count)
        chosen = np.concatenate([chosen, best[None]])
    return chosen


def _any_place(problem: Problem, chosen: FloatArray, grid: FloatArray, count: int) -> FloatArray:
    """Return an allowed place between those of the grid."""
    others = problem.cell.places(chosen).turned
    label = f"{len(chosen) + 1} of {count}"
    try:
        return nearest(problem.cell, grid[-1], others, grid, label)
    except UndeterminedError as error:
        error.hint = f"{error.hint}; or plan fewer stations"
        raise


def _merit(problem: Problem, others: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Return the figure of one more station beside others; infinite where it is not allowed."""
    turned = problem.cell.places(others).turned
    gathered = _gathered(problem, others)

    def merit(at: FloatArray) -> FloatArray:
        places = problem.cell.places(at)
        good = np.flatnonzero(np.all(problem.cell.excess(places, turned) == 0.0, axis=1))
        values = np.full(len(at), np.inf)
        if len(good):
            rows = problem.rig.rows(places.cameras[good])
            values[good] = problem.with_one_more(gathered, rows)
        return values

    return merit


def _polished(problem: Problem, chosen: FloatArray, choice: _Choice) -> FloatArray:
    """Return stations of which none alone could be put to a better place."""
    chosen, figure = chosen.copy(), np.inf
    for sweep in range(_SWEEPS):
        before, steps = figure, problem.free * 0.5 ** (sweep / 2.0)
        for i in range(len(chosen)):
            chosen[i], figure = _improved(problem, chosen, i, choice, steps)
        if before - figure <= _WORTH_IT * figure:
            break
    return chosen


def _improved(
    problem: Problem, chosen: FloatArray, i: int, choice: _Choice, steps: FloatArray
) -> tuple[FloatArray, float]:
    """Return a better place for one of the stations, and the figure with it."""
    others = np.delete(chosen, i, axis=0)
    merit = _merit(problem, others)
    start = chosen[i : i + 1]
    figures = choice.figures(problem, others)
    if len(figures) and np.min(figures) < merit(start)[0]:
        start = choice.places.views[[int(np.argmin(figures))]]
    found, value = minimise(merit, start, steps, rounds=12, finest=_NEARLY)
    return found[0], float(value[0])
