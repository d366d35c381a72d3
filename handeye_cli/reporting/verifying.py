"""The verifications that a report makes for itself, and why some of them cannot be made."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from handeye_cli import pipeline
from handeye_cli.chain import MIN_STATIONS
from handeye_cli.errors import ConvergenceError, HandeyeError, UndeterminedError
from handeye_cli.pipeline import Steps
from handeye_cli.records import Stations, Verification

_ROWS = 5
"""Numbers of stations that a verification calibrates on, at most: as many as the paper's table."""
_FEWEST = 4
"""Stations of the first of them, as in the paper's table."""
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True)
class Approach:
    """How an answer is looked for.

    Attributes:
        steps: How images are looked at.
        method: A row of the table of solvers.
        pairs: `star` or `all`.
    """

    steps: Steps
    method: str
    pairs: str


@dataclass(frozen=True)
class Verified:
    """What was made.

    Attributes:
        verifications: The paper's table and the errors at each station left out, as far as they
            can be had.
        remarks: In which order the table takes the stations if it is not their own, and why rows
            of it are missing.
    """

    verifications: tuple[Verification, ...]
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Table:
    """The paper's table, or None, and why rows are missing, by their numbers of stations."""

    verification: Verification | None
    missing: dict[int, HandeyeError]


def verified(stations: Stations, approach: Approach) -> Verified:
    """Verify on the stations of a document, in all ways that need no others.

    Stations that were taken along one direction first determine nothing for long; then the table is
    made from the same stations in another order.
    """
    table, left_out = _table(stations, approach), _left_out(stations, approach)
    usable = _usable(stations)
    remarks = _missing_rows(table) if _numbers(usable) else (_too_few(usable),)
    if table.verification is None and table.missing:
        mixed = _mixed(stations)
        again = _table(mixed, approach)
        if again.verification is not None:
            remarks = (*remarks, _order(mixed), *_missing_rows(again))
            table = again
    found = (table.verification, left_out)
    return Verified(tuple(each for each in found if each is not None), remarks)


def _table(stations: Stations, approach: Approach) -> _Table:
    """Return the paper's table without the rows whose stations determine nothing."""
    tables: list[Verification] = []
    missing: dict[int, HandeyeError] = {}
    for count in _numbers(_usable(stations)):
        try:
            tables.append(_verify(stations, approach, [count]))
        except (UndeterminedError, ConvergenceError) as error:
            missing[count] = error
    rows = tuple(row for table in tables for row in table.rows)
    return _Table(replace(tables[-1], rows=rows) if tables else None, missing)


def _usable(stations: Stations) -> int:
    return sum(each.camera_T_target is not None for each in stations.stations)


def _numbers(usable: int) -> list[int]:
    """Return the numbers of stations that the rows calibrate on."""
    largest = usable // 2
    counts = np.unique(np.linspace(min(_FEWEST, largest), largest, _ROWS).round().astype(int))
    return [int(count) for count in counts if count >= MIN_STATIONS]


def _missing_rows(table: _Table) -> tuple[str, ...]:
    """Return why rows are missing, in the words of the one that had most stations."""
    if not table.missing:
        return ()
    *fewer, most = table.missing
    numbers = f"{', '.join(map(str, fewer))} or {most}" if fewer else str(most)
    reason = table.missing[most].message
    return (f"No row calibrates on the first {numbers} stations; with {most}: {reason}.",)


def _mixed(stations: Stations) -> Stations:
    """Return the stations so that the first ones come from all along the document."""
    # multiples of the golden ratio fill an interval evenly, however many there are of them
    places = np.arange(len(stations.stations)) * _GOLDEN % 1.0
    order = np.argsort(np.argsort(places))
    return replace(stations, stations=tuple(stations.stations[index] for index in order))


def _order(stations: Stations) -> str:
    names = ", ".join(each.name for each in stations.stations)
    return f"The table takes the stations in another order than their own: {names}."


def _too_few(usable: int) -> str:
    return (
        f"There are no errors against the number of stations: expected at least {2 * MIN_STATIONS} "
        f"usable stations, half to calibrate on and half to verify with, found {usable}."
    )


def _left_out(stations: Stations, approach: Approach) -> Verification | None:
    with suppress(UndeterminedError, ConvergenceError):
        return _verify(stations, approach, None, leave_one_out=True)
    return None


def _verify(
    stations: Stations, approach: Approach, counts: list[int] | None, *, leave_one_out: bool = False
) -> Verification:
    return pipeline.to_verification(
        stations,
        approach.steps,
        None,
        counts=counts,
        method=approach.method,
        pairs=approach.pairs,
        leave_one_out=leave_one_out,
    )
