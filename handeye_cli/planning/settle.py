"""Stations that break a limit, moved to the nearest allowed place; or why there is none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from handeye_cli.errors import UndeterminedError
from handeye_cli.geometry import rotations
from handeye_cli.planning import views
from handeye_cli.planning.cell import Cell, Places
from handeye_cli.planning.pattern import minimise
from handeye_cli.records import FloatArray

_STARTS = 24
"""Places of the grid that the search for an allowed one starts from."""
_FINISHED = 4
"""Of these, those that are followed to the end."""
_FORBIDDEN = 1e6
"""Merit of a place that breaks a limit by nothing, far above that of any allowed one."""


@dataclass(frozen=True)
class Settled:
    """Stations at allowed places.

    Attributes:
        views: (N, 6) places.
        broken: For each station the names of the limits it broke before; empty where it stayed.
    """

    views: FloatArray
    broken: tuple[tuple[str, ...], ...]


def broken_limits(cell: Cell, at: FloatArray) -> tuple[tuple[str, ...], ...]:
    """Return the names of the limits that each of (N, 6) views breaks, alone or with another."""
    if not cell.names:
        return ((),) * len(at)
    places = cell.places(at)
    excess = np.array([_beside_the_others(cell, places, i) for i in range(len(at))])
    return tuple(
        tuple(name for name, value in zip(cell.names, row, strict=True) if value > 0.0)
        for row in excess
    )


def settle(cell: Cell, wanted: FloatArray, grid: FloatArray, labels: list[str]) -> Settled:
    """Move stations that break a limit to the nearest allowed place.

    Those that break the least come first; each one then keeps clear of those before it.

    Args:
        cell: What is allowed.
        wanted: (N, 6) places asked for.
        grid: (K, 6) places to start the search from.
        labels: Names of the stations, for the message.

    Raises:
        UndeterminedError: A station has no allowed place.
    """
    broken = broken_limits(cell, wanted)
    if not any(broken):
        return Settled(wanted, broken)
    places = cell.places(wanted)
    order = np.argsort([_burden(cell, places, i) for i in range(len(wanted))], kind="stable")
    settled, done = wanted.copy(), np.zeros((0, 3, 3))
    left: list[tuple[str, ...]] = [()] * len(wanted)
    for i in order:
        if np.any(cell.excess(places.part([i]), done) > 0.0):
            settled[i] = nearest(cell, wanted[i], done, grid, labels[i])
            left[i] = broken[i]
        done = np.concatenate([done, cell.places(settled[i : i + 1]).turned])
    return Settled(settled, tuple(left))


def _beside_the_others(cell: Cell, places: Places, i: int) -> FloatArray:
    return np.asarray(cell.excess(places.part([i]), np.delete(places.turned, i, axis=0))[0])


def _burden(cell: Cell, places: Places, i: int) -> float:
    """Return how much a station breaks, that with every other one added up."""
    alone = cell.excess_alone(places.part([i])).sum()
    turned = places.turned
    beside = [each.excess(turned[i : i + 1], np.delete(turned, i, axis=0)).sum()
              for each in cell.pair_limits]  # fmt: skip
    return float(alone + sum(beside))


def nearest(
    cell: Cell, wanted: FloatArray, others: FloatArray, grid: FloatArray, label: str
) -> FloatArray:
    """Return the (6,) allowed view nearest to a wanted one.

    Args:
        cell: What is allowed.
        wanted: (6,) place asked for.
        others: (M, 3, 3) rotations of the stations it would stand beside.
        grid: (K, 6) places to start the search from.
        label: Name of the station, for the message.

    Raises:
        UndeterminedError: No allowed place was found.
    """
    merit = _merit(cell, wanted, others)
    starts = np.concatenate([wanted[None], grid])
    starts = starts[np.argsort(merit(starts), kind="stable")[:_STARTS]]
    steps = np.array([0.2, 0.2, 0.5, 0.25 * wanted[views.DISTANCE], 0.1, 0.1])
    near, values = minimise(merit, starts, steps, rounds=15)
    near = near[np.argsort(values, kind="stable")[:_FINISHED]]
    found, values = minimise(merit, near, steps / 4.0, finest=1e-4)
    best = int(np.argmin(values))
    if values[best] >= _FORBIDDEN:
        raise _infeasible(cell, np.concatenate([found, grid]), others, label)
    return np.asarray(found[best])


def _merit(
    cell: Cell, wanted: FloatArray, others: FloatArray
) -> Callable[[FloatArray], FloatArray]:
    """Return a merit that first leads to an allowed place, and then to the nearest one."""
    goal = cell.cameras_of(wanted[None])

    def merit(at: FloatArray) -> FloatArray:
        places = cell.places(at)
        excess = np.sum(cell.excess(places, others), axis=1)
        turn, shift = apart(places.cameras, goal)
        near = turn + shift / wanted[views.DISTANCE]
        return np.asarray(np.where(excess > 0.0, _FORBIDDEN * (1.0 + excess), near))

    return merit


def apart(cameras: FloatArray, origin: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (K,) angles and distances between (K, 4, 4) poses and others."""
    turn = rotations.angle(cameras[:, :3, :3] @ np.swapaxes(origin[:, :3, :3], -1, -2))
    return turn, np.linalg.norm(cameras[:, :3, 3] - origin[:, :3, 3], axis=1)


def _infeasible(cell: Cell, tried: FloatArray, others: FloatArray, label: str) -> UndeterminedError:
    """Return the error that names the limit that binds.

    It is one that no place keeps or, where every limit has places of its own, the one that would
    have to give way least for the others to be kept.
    """
    excess = cell.excess(cell.places(tried), others)
    least = excess.min(axis=0)
    if np.any(least > 0.0):
        column = int(np.argmax(least))
        start = f"station {label}: no place keeps the limit {cell.names[column]}"
        return _refusal(f"{start}; the nearest misses it by", cell, column, float(least[column]))
    alone = excess == excess.sum(axis=1, keepdims=True)
    if np.any(alone):
        missed = np.where(alone, excess, np.inf).min(axis=0)
        column = int(np.argmin(missed))
        start = f"station {label}: no place that keeps the other limits keeps {cell.names[column]}"
        return _refusal(f"{start} as well; the nearest misses it by", cell, column, missed[column])
    nearest_one = excess[int(np.argmin(excess.sum(axis=1)))]
    column = int(np.argmax(nearest_one))
    names = ", ".join(np.array(cell.names)[nearest_one > 0.0])
    start = f"station {label}: no place keeps the limits {names} together; the nearest misses"
    return _refusal(f"{start} {cell.names[column]} by", cell, column, float(nearest_one[column]))


_ADVICE = {
    "distance": "let the distance vary: --depth NEAREST,FARTHEST",
    "view": "stand farther away (--distance, --depth), tilt less, or narrow --margin-px",
}


def _refusal(start: str, cell: Cell, column: int, excess: float) -> UndeterminedError:
    name = cell.names[column]
    hint = _ADVICE.get(name, f"widen --{name}, or another limit")
    return UndeterminedError(f"{start} {cell.in_words(column, excess)}", hint=hint)
