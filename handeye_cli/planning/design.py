"""Stations that make the answer as sure as the cell allows: exchange, then polish (A-optimal).

The figure to make small is the expected square of the answer's rotation error plus that of its
translation error, each in units of what the paper's layout gives. A station is worth

    tr W (I + W P W')^-1 W P^2, weighted

W being its whitened rows and P the covariance without it, so thousands of places cost one batch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from handeye_cli.errors import UndeterminedError
from handeye_cli.planning import views
from handeye_cli.planning.cell import Cell, Places
from handeye_cli.planning.pattern import minimise
from handeye_cli.planning.prediction import Rig, covariance, information
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
        recorded: (D, 12, 12) information of what was recorded already.
        free: (6,) first steps of the polish; 0 for what is not to be changed.
    """

    rig: Rig
    cell: Cell
    weights: FloatArray
    recorded: FloatArray
    free: FloatArray

    def figure(self, gathered: FloatArray) -> float:
        """Return the figure for (D, 12, 12) information."""
        variances = np.einsum("dii->i", covariance(gathered)[:, :6, :6]) / len(gathered)
        return float(variances @ self._per_axis)

    def with_one_more(self, gathered: FloatArray, rows: FloatArray) -> FloatArray:
        """Return the (K,) figures with one of K stations added.

        Args:
            gathered: (D, 12, 12) information of the others.
            rows: (D, K, 6, 12) whitened rows of the stations.
        """
        P = covariance(gathered)[:, None]
        spread = rows @ P
        seen = spread[..., :6] * np.sqrt(self._per_axis)
        inner = np.eye(6) + spread @ np.swapaxes(rows, -1, -2)
        gain = np.einsum("dkij,dkij->k", seen, np.linalg.solve(inner, seen)) / len(rows)
        return np.asarray(self.figure(gathered) - gain)

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
    """K places that are allowed by themselves, with their (D, K, 6, 12) whitened rows."""

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
    return np.asarray(problem.recorded + _PRIOR + information(rows))


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
