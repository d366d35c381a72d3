"""What a case lacks for its report, made by the stages of the line."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from handeye_cli import pipeline
from handeye_cli.chain import MIN_STATIONS
from handeye_cli.errors import ConvergenceError, UndeterminedError, UsageError
from handeye_cli.given_camera import with_camera
from handeye_cli.pipeline import Steps
from handeye_cli.records import Inspection, Stations, Verification, VerificationRow
from handeye_cli.reporting.case import Case

_ROWS = 5
"""Numbers of stations that a verification calibrates on, at most: as many as the paper's table."""
_FEWEST = 4
"""Stations of the first of them, as in the paper's table."""


@dataclass(frozen=True)
class Way:
    """How an answer is looked for.

    Attributes:
        steps: How images are looked at.
        method: A row of the table of solvers.
        pairs: `star` or `all`.
    """

    steps: Steps
    method: str
    pairs: str


def complete(case: Case, way: Way) -> Case:
    """Return a case with everything that can be made from what it holds.

    A calibration that is there stays what it is, and so do the verdicts on it: then only the points
    and poses that its pictures need are made. Data without an answer are inspected all the same.

    Raises:
        InputError: An image or the pixels of a document are not what they should be.
        UsageError: The method or the pairs are unknown, or a flag cannot act on the document.
    """
    case = _with_poses(case, way.steps)
    stations = case.stations
    if case.calibration is not None or stations is None:
        return case
    if case.inspection is None:
        found = _inspected(case, way.steps)
        case = replace(case, inspection=found, attempted=True)
    if case.inspection is not None and case.inspection.errors:
        return case
    way = replace(way, steps=replace(way.steps, calibrate_intrinsics=False))
    return _with_answer(case, stations, way)


def _with_poses(case: Case, steps: Steps) -> Case:
    """Return a case with points and poses; those beside an answer rest on its own intrinsics."""
    from handeye_cli import documents

    recording, features, answer = case.recording, case.features, case.calibration
    if answer is not None and steps.calibrate_intrinsics:
        raise UsageError(
            f"--calibrate-intrinsics has no effect: the answer is there already, in {case.name}",
            hint="leave it out, or make the report from the recording alone",
        )
    if case.stations is not None:
        return replace(case, stations=pipeline.to_stations(case.stations, steps))
    if recording is None and features is None:
        return case
    camera = None if answer is None else answer.camera
    if features is None:
        seen_by = recording if camera is None else with_camera(recording, camera)
        features = documents.as_written(pipeline.to_features(seen_by, steps))
    elif camera is not None:
        features = with_camera(features, camera)
    stations = documents.as_written(pipeline.to_stations(features, steps))
    return replace(case, features=features, stations=stations)


def _inspected(case: Case, steps: Steps) -> Inspection:
    # only from the points does it know what the detector thinks of its own accuracy
    if case.features is not None and case.stations is not None:
        return pipeline.to_inspection(case.features, steps)
    return pipeline.to_inspection(case.stations, replace(steps, calibrate_intrinsics=False))


def _with_answer(case: Case, stations: Stations, way: Way) -> Case:
    try:
        answer = pipeline.to_calibration(stations, way.steps, method=way.method, pairs=way.pairs)
    except (UndeterminedError, ConvergenceError) as error:
        # the inspection rests on the default method; another one may fail where that does not
        return replace(case, failure=error)
    case = replace(case, calibration=answer)
    if case.verifications:
        return case
    return replace(case, verifications=_verifications(stations, way))


def _verifications(stations: Stations, way: Way) -> tuple[Verification, ...]:
    """Return the paper's table and the errors at each station left out, as far as there are any."""
    usable = sum(each.camera_T_target is not None for each in stations.stations)
    found = (_table(stations, usable, way), _left_out(stations, way))
    return tuple(each for each in found if each is not None)


def _table(stations: Stations, usable: int, way: Way) -> Verification | None:
    """Return the paper's table without the rows whose stations determine nothing."""
    largest = usable // 2
    smallest = min(_FEWEST, largest)
    tables = []
    for count in np.unique(np.linspace(smallest, largest, _ROWS).round().astype(int)):
        if count < MIN_STATIONS:
            continue
        with suppress(UndeterminedError, ConvergenceError):
            tables.append(_verify(stations, way, [int(count)]))
    rows: tuple[VerificationRow, ...] = tuple(row for table in tables for row in table.rows)
    return replace(tables[-1], rows=rows) if tables else None


def _left_out(stations: Stations, way: Way) -> Verification | None:
    with suppress(UndeterminedError, ConvergenceError):
        return _verify(stations, way, None, leave_one_out=True)
    return None


def _verify(
    stations: Stations, way: Way, counts: list[int] | None, *, leave_one_out: bool = False
) -> Verification:
    return pipeline.to_verification(
        stations,
        way.steps,
        None,
        counts=counts,
        method=way.method,
        pairs=way.pairs,
        leave_one_out=leave_one_out,
    )
