"""The lists of robot and target poses paired in another way: shifted or reversed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from handeye_cli.diagnosis.hypotheses import Hypothesis
from handeye_cli.diagnosis.readings import Reading
from handeye_cli.records import IntArray

_FARTHEST = 30
"""Places by which long lists are tried against each other."""
_MOST_STARTS = 60
"""Stations from which on a long list may be shifted by one place."""
_FEWEST = 4
"""Stations that a shift has to leave: with three, too much fits."""
SHIFTED = "lists-shifted"
_ADVICE = (
    "a picture without a target, or one taken twice, shifts all that follow: record the "
    "name or the time of the picture with each robot pose"
)


def pairings(reading: Reading) -> list[Hypothesis]:
    """Return what the lists give when they are shifted or reversed."""
    return [*_shifts(reading), _reversal(reading), *_late_shifts(reading)]


def paired(
    reading: Reading, rows: IntArray, code: str, description: str, advice: str = _ADVICE
) -> Hypothesis:
    """Return the stations with other robot poses.

    Args:
        reading: The numbers as declared.
        rows: (N,) the robot pose of each target pose; those outside the list take no part.
        code: Stable short name in kebab-case.
        description: In words, to follow "if".
        advice: The next step if it is true.
    """
    inside = (rows >= 0) & (rows < len(reading.robot))
    A = reading.reference_T_mount(
        reading.robot[np.where(inside, rows, 0)], inverted=reading.inverted
    )
    return Hypothesis(code, description, "", advice, A, reading.camera, inside, paired_anew=True)


def _places(shift: int) -> str:
    places = "one place" if abs(shift) == 1 else f"{abs(shift)} places"
    return f"{places} {'later' if shift > 0 else 'earlier'}"


def _shifts(reading: Reading) -> Iterator[Hypothesis]:
    """All shifts, first with the ends of the list joined, then with the ends dropped."""
    count = len(reading.robot)
    farthest = min(count - 1, _FARTHEST)
    shifts = sorted((k for k in range(-farthest, farthest + 1) if k), key=abs)
    for shift in shifts:
        if -count < 2 * shift <= count:
            words = f"the target poses belong to the robot poses {_places(shift)} in the list"
            rows = (reading.index + shift) % count
            yield paired(reading, rows, SHIFTED, f"{words}, the last of them to the first")
    for shift in shifts:
        rows = reading.index + shift
        if np.sum((rows >= 0) & (rows < count)) >= _FEWEST:
            words = f"the target poses belong to the robot poses {_places(shift)} in the list"
            yield paired(reading, rows, SHIFTED, words)


def _reversal(reading: Reading) -> Hypothesis:
    rows = len(reading.robot) - 1 - reading.index
    return paired(reading, rows, "lists-reversed", "one of the lists is the other way round")


def _late_shifts(reading: Reading) -> Iterator[Hypothesis]:
    """Shifts by one place that begin at a station, as one lost or doubled picture makes them."""
    starts = reading.index[1:-1]
    spread = np.linspace(0, len(starts) - 1, min(len(starts), _MOST_STARTS)).astype(int)
    for start, shift in ((start, shift) for start in starts[spread] for shift in (1, -1)):
        rows = reading.index + shift * (reading.index >= start)
        rows[(reading.index == start) & (shift < 0)] = -1
        words = f"from station {reading.names[start]} on the target poses belong to the robot poses"
        yield paired(reading, rows, SHIFTED, f"{words} {_places(shift)} in the list")
