"""What a case lacks for its report, made by the stages of the line."""

from __future__ import annotations

from dataclasses import replace

from handeye_cli import documents, pipeline
from handeye_cli.errors import ConvergenceError, UndeterminedError, UsageError
from handeye_cli.given_camera import with_camera
from handeye_cli.inspection import with_time_offset
from handeye_cli.pipeline import Steps
from handeye_cli.records import Features, Inspection, Recording, Stations
from handeye_cli.reporting.case import Case
from handeye_cli.reporting.verifying import Approach, verified
from handeye_cli.time_offset import Measured


def complete(case: Case, approach: Approach) -> Case:
    """Return a case with everything that can be made from what it holds.

    A calibration that is there stays what it is, and so do the verdicts on it: then only the points
    and poses that its pictures need are made. Data without an answer are inspected all the same.

    Raises:
        InputError: An image or the pixels of a document are not what they should be.
        UsageError: The method or the pairs are unknown, or a flag cannot act on the document.
    """
    case, measured = _with_poses(case, approach.steps)
    stations = case.stations
    if case.calibration is not None or stations is None:
        return case
    if case.inspection is None:
        found = _inspected(case, measured, approach.steps)
        case = replace(case, inspection=found, attempted=True)
    if case.inspection is not None and case.inspection.errors:
        return case
    approach = replace(approach, steps=replace(approach.steps, calibrate_intrinsics=False))
    return _with_answer(case, stations, approach)


def _with_poses(case: Case, steps: Steps) -> tuple[Case, Measured | None]:
    """Return a case with points and poses, and the time that frames in motion tell.

    Those beside an answer rest on its own intrinsics.
    """
    recording, features, answer = case.recording, case.features, case.calibration
    if answer is not None and steps.calibrate_intrinsics:
        raise UsageError(
            f"--calibrate-intrinsics has no effect: the answer is there already, in {case.name}",
            hint="leave it out, or make the report from the recording alone",
        )
    if case.stations is not None:
        return replace(case, stations=pipeline.to_stations(case.stations, steps)), None
    camera, measured = None if answer is None else answer.camera, None
    if features is not None:
        features = features if camera is None else with_camera(features, camera)
    elif recording is not None:
        seen_by = recording if camera is None else with_camera(recording, camera)
        features, measured = _features(seen_by, steps, timed=answer is None)
    else:
        return case, None
    stations = documents.as_written(pipeline.to_stations(features, steps))
    return replace(case, features=features, stations=stations), measured


def _features(
    recording: Recording, steps: Steps, *, timed: bool
) -> tuple[Features, Measured | None]:
    """Return the points in the images of a recording, and the time where it is asked for."""
    if timed:
        features, measured = pipeline.features_and_time(recording, steps)
    else:
        features, measured = pipeline.to_features(recording, steps), None
    return documents.as_written(features), measured


def _inspected(case: Case, measured: Measured | None, steps: Steps) -> Inspection:
    # only from the points does it know what the detector thinks of its own accuracy
    if case.features is not None and case.stations is not None:
        looked = pipeline.to_inspection(case.features, steps)
    else:
        looked = pipeline.to_inspection(case.stations, replace(steps, calibrate_intrinsics=False))
    if measured is not None:
        looked = with_time_offset(looked, measured)
    return replace(looked, recording=case.summary)


def _with_answer(case: Case, stations: Stations, approach: Approach) -> Case:
    try:
        answer = pipeline.to_calibration(
            stations, approach.steps, method=approach.method, pairs=approach.pairs
        )
    except (UndeterminedError, ConvergenceError) as error:
        # the inspection rests on the default method; another one may fail where that does not
        return replace(case, failure=error)
    case = replace(case, calibration=answer)
    if case.verifications:
        return case
    made = verified(stations, approach)
    return replace(case, verifications=made.verifications, remarks=made.remarks)
