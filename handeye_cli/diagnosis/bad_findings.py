"""What is said about bad stations: which, how far off, why probably, and what to do."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from handeye_cli.conventions import MM, Setup
from handeye_cli.records import Finding
from handeye_cli.records.bad_stations import BadKind, BadStation, BadStations, TargetMove

_MOST_NAMES = 12


def findings_of_bad(bad: BadStations, names: Sequence[str], setup: Setup) -> tuple[Finding, ...]:
    """Return the findings on the stations of a chain.

    Args:
        bad: What was found out.
        names: Of the stations, by row of the chain.
        setup: Names what the target is fixed to.
    """
    return tuple(_findings(bad, names, setup))


def reasons_of_bad(bad: BadStations, names: Sequence[str]) -> dict[int, str]:
    """Return why stations are left out, by row of the chain.

    Args:
        bad: What was found out.
        names: Of the stations, by row of the chain.
    """
    reasons = {}
    if bad.moved is not None:
        before, after = names[bad.moved.before], names[bad.moved.after]
        moved = f'the target was moved between stations "{before}" and "{after}"'
        reasons = dict.fromkeys(bad.moved.rows, moved)
    reasons |= {
        station.row: f"the others contradict it: {_off(station)}" for station in bad.outliers
    }
    for cycle in bad.exchanged:
        for row in cycle:
            others = [each for each in cycle if each != row]
            mixed_up = "its image and robot pose are mixed up with those of"
            reasons[row] = f"{mixed_up} {_quoted(others, names)}"
    return {row: reasons[row] for row in bad.left_out}


def _findings(bad: BadStations, names: Sequence[str], setup: Setup) -> Iterator[Finding]:
    if bad.moved is not None:
        yield _moved(bad.moved, names, setup)
    left_out = "left out" if not bad.too_many else "not left out"
    for cycle in bad.exchanged:
        yield _exchanged(cycle, names, left_out)
    if bad.too_many:
        yield _too_many(bad, names)
        return
    for station in bad.outliers:
        if station.kind is not BadKind.EXCHANGED:
            yield _bad(station, names)


def _moved(moved: TargetMove, names: Sequence[str], setup: Setup) -> Finding:
    before, after = names[moved.before], names[moved.after]
    message = (
        f'from station "{after}" on all stations see the target {_apart(moved)} away from where '
        f'those up to station "{before}" see it, {moved.sigmas:.3g} standard deviations: the '
        f'target was moved on its {setup.reference} between stations "{before}" and "{after}"'
    )
    advice = (
        f"{_quoted(moved.rows, names)} are left out; fix the target to the {setup.reference} and "
        f'record again; or solve two documents, one with the stations up to "{before}" and one '
        f'with those from "{after}" on'
    )
    return Finding("target-moved", "warning", message, advice)


def _exchanged(cycle: tuple[int, ...], names: Sequence[str], left_out: str) -> Finding:
    if len(cycle) == 2:
        message = (
            f"the images of {_quoted(cycle, names)} are exchanged: each fits the robot pose of the "
            "other"
        )
    else:
        poses = (*cycle[1:], cycle[0])
        message = (
            f"the images of {_quoted(cycle, names)} are interchanged: they fit the robot poses of "
            f"{_quoted(poses, names)}, in this order"
        )
    advice = f"they are {left_out}; give each image its own robot pose, and solve again"
    return Finding("stations-exchanged", "warning", message, advice)


def _too_many(bad: BadStations, names: Sequence[str]) -> Finding:
    rows = [station.row for station in bad.outliers]
    message = (
        f"{len(rows)} of {bad.count} stations contradict what the others agree on: "
        f"{_quoted(rows, names)}; of so many it is not certain which ones are wrong"
    )
    advice = (
        "nothing is left out, and the answer is not to be trusted: check that images and robot "
        "poses belong together and that the target stood still, and record again"
    )
    if bad.noise_given:
        advice += "; or give larger levels under 'noise', if they are too small"
    return Finding("too-many-bad-stations", "error", message, advice)


def _bad(station: BadStation, names: Sequence[str]) -> Finding:
    message = f'station "{names[station.row]}" sees the target {_off(station)}'
    advice = "it is left out; look at its image, its robot pose and whether the target was moved"
    if station.kind is BadKind.TURNED:
        message += "; the target looks turned about its normal by whole quarters"
        advice = "it is left out; look at its image: the target's points were named wrongly"
    return Finding("bad-station", "warning", message, advice)


def _off(station: BadStation) -> str:
    return (
        f"{_apart(station)} away from where all others see it, "
        f"{station.sigmas:.3g} standard deviations"
    )


def _apart(what: BadStation | TargetMove) -> str:
    return f"{what.translation / MM:.3g} mm and {np.degrees(what.rotation):.2g} deg"


def _quoted(rows: Sequence[int], names: Sequence[str]) -> str:
    shown = [f'"{names[row]}"' for row in rows[:_MOST_NAMES]]
    more = [f"{len(rows) - _MOST_NAMES} more"] if len(rows) > _MOST_NAMES else []
    *first, last = shown + more
    noun = "stations" if first else "station"
    return f"{noun} {', '.join(first)} and {last}" if first else f"{noun} {last}"
