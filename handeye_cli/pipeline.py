"""From whatever record there is to the stage that is wanted, running what is missing.

A stage takes the recording or any record up to its own input. A later one is refused: nothing leads
back from it. What one stage hands on to the next is what its document would say, so that one
command and a pipe of several give the same digits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError, UsageError
from handeye_cli.geometry.extent import middle_of
from handeye_cli.records import Features, Recording, Stations

if TYPE_CHECKING:
    from handeye_cli.planning.options import PlanOptions
    from handeye_cli.records import (
        Calibration,
        Finding,
        FloatArray,
        Inspection,
        Plan,
        TargetSpec,
        Verification,
    )
    from handeye_cli.records.moving import MovingFrames
    from handeye_cli.time_offset import Measured

Handed = TypeVar("Handed", Features, Stations)

_MAKERS = {"calibration": "handeye solve", "plan": "handeye plan"}
"""What makes a document that nothing else can stand in for."""

# The stages are imported where they are run: what needs no images does not wait for OpenCV.


@dataclass(frozen=True)
class Steps:
    """How the steps before the wanted one are run.

    Attributes:
        workers: Threads that look at images, or None for one per processor.
        progress: Told (done, all) after each image, or None.
        calibrate_intrinsics: Whether the intrinsics are estimated from the same images.
    """

    workers: int | None = None
    progress: Callable[[int, int], None] | None = None
    calibrate_intrinsics: bool = False


def expect(record: Any, *kinds: type) -> None:
    """Check that a record is of one of these kinds.

    Raises:
        InputError: It is of another stage.
    """
    if isinstance(record, kinds):
        return
    *most, last = (each.__name__.lower() for each in kinds)
    expected = f"{', '.join(most)} or {last}" if most else last
    made = None if most else _MAKERS.get(last)
    raise InputError(
        f"expected a {expected} document, found a {type(record).__name__.lower()} document",
        hint=f"{made} makes one"
        if made
        else "give the recording itself or the document of an earlier stage",
    )


def to_features(record: Any, steps: Steps) -> Features:
    """Return the target points in the images of a recording, or the features themselves.

    Raises:
        InputError: The record is of a later stage.
    """
    if isinstance(record, Features):
        return record
    expect(record, Recording, Features)
    if record.moving is not None and record.moving.are_stations:
        return _in_motion(record, record.moving, steps)[0]
    from handeye_cli.extract import extract

    return extract(record, workers=steps.workers, progress=steps.progress)


def _in_motion(
    recording: Recording, moving: MovingFrames, steps: Steps
) -> tuple[Features, Measured]:
    """Return the target points in frames along the robot's way, and the time that they tell."""
    from handeye_cli.time_offset import extract_in_motion

    return extract_in_motion(recording, moving, workers=steps.workers, progress=steps.progress)


def to_stations(record: Any, steps: Steps) -> Stations:
    """Return the target's pose at every station, or the stations themselves.

    Raises:
        InputError: The record is of a later stage, or has points that its target has not.
        UsageError: Intrinsics are asked for, but the target's poses are already there.
    """
    if isinstance(record, Stations):
        _refuse_intrinsics(steps)
        return record
    expect(record, Recording, Features, Stations)
    from handeye_cli.extrinsics import extrinsics

    if isinstance(record, Features):
        _require_points_of_target(record)
        features = record
    else:
        features = _handed_on(to_features(record, steps))
    return extrinsics(features, calibrate_intrinsics=steps.calibrate_intrinsics)


def _require_points_of_target(features: Features) -> None:
    from handeye_cli import targets
    from handeye_cli.views import require_points_of_target

    require_points_of_target(features.stations, len(targets.build(features.target).points()))


def ready_stations(record: Any, steps: Steps) -> Stations:
    """Return the stations as the stages behind them have them, alone or in a pipe.

    Raises:
        InputError: The record is of a later stage, or has points that its target has not.
        UsageError: Intrinsics are asked for, but the target's poses are already there.
    """
    stations = to_stations(record, steps)
    return stations if stations is record else _handed_on(stations)


def _handed_on(record: Handed) -> Handed:
    from handeye_cli import documents

    return documents.as_written(record)


def to_calibration(
    record: Any,
    steps: Steps,
    *,
    method: str,
    pairs: str,
    compare: bool = False,
    partial: bool = False,
) -> Calibration:
    """Return where the camera sits, from any record up to the stations.

    Args:
        record: Any record up to the stations.
        steps: How the steps before are run.
        method: A row of the table of solvers.
        pairs: `star` or `all`.
        compare: Whether all other methods are listed beside it.
        partial: Whether the determined part will do where not all is determined.

    Raises:
        InputError: The record is of a later stage.
        UsageError: The method or the pairs are unknown, or partial answers are to be compared.
    """
    if compare and partial:
        raise UsageError("expected --compare or --partial, found both")
    if partial:
        from handeye_cli.solve_determined import solve_determined

        return solve_determined(ready_stations(record, steps), method=method, pairs=pairs)
    if compare:
        from handeye_cli import compare as comparison

        return comparison.compare(ready_stations(record, steps), method=method, pairs=pairs)
    from handeye_cli.solve import solve

    return solve(ready_stations(record, steps), method=method, pairs=pairs)


def to_inspection(record: Any, steps: Steps) -> Inspection:
    """Return what is right and what is wrong with the data of any record up to the stations.

    Raises:
        InputError: The record is of a later stage.
    """
    from handeye_cli.inspection import inspect, with_time_offset

    expect(record, Recording, Features, Stations)
    measured = None
    if isinstance(record, Recording):
        features, measured = features_and_time(record, steps)
        record = _handed_on(features)
    sigma = _detector_sigma(record) if isinstance(record, Features) else None
    looked = inspect(ready_stations(record, steps), sigma)
    return looked if measured is None else with_time_offset(looked, measured)


def features_and_time(recording: Recording, steps: Steps) -> tuple[Features, Measured | None]:
    """Return a recording's target points, and the time that frames in motion tell if there are any.

    These are looked at besides the stations where they are none themselves.
    """
    if recording.moving is None:
        return to_features(recording, steps), None
    in_motion, measured = _in_motion(recording, recording.moving, steps)
    if recording.moving.are_stations:
        return in_motion, measured
    return to_features(recording, steps), measured


def _detector_sigma(features: Features) -> float | None:
    """Return the RMS of the standard deviations that the detector gave, pixels."""
    seen = (each.observation for each in features.stations)
    sigmas = [each.sigma_px for each in seen if each is not None and each.sigma_px is not None]
    return float(np.sqrt(np.mean(np.square(sigmas)))) if sigmas else None


def to_verification(
    record: Any,
    steps: Steps,
    calibration: Calibration | None,
    *,
    counts: Sequence[int] | None,
    method: str,
    pairs: str,
    leave_one_out: bool = False,
    target_moved: bool = False,
) -> Verification:
    """Return held-out errors: of an existing calibration, the paper's protocol, or leave-one-out.

    Args:
        record: Any record up to the stations, to verify on and, where there is no calibration, to
            calibrate on.
        steps: How the steps before are run.
        calibration: An answer made from other stations, or None.
        counts: Stations to calibrate on, for each row; half of them when None.
        method: A row of the table of solvers.
        pairs: `star` or `all`.
        leave_one_out: Whether each station is predicted by a calibration on all others.
        target_moved: Whether the target was moved after the calibration.

    Raises:
        UsageError: A count is out of range, or the calibration is for another setup.
        InputError: The record is of a later stage.
    """
    from handeye_cli import leave_one_out as leaving_one_out
    from handeye_cli.verify import verify, verify_calibration

    stations = ready_stations(record, steps)
    if calibration is not None:
        return verify_calibration(stations, calibration, target_moved=target_moved)
    if leave_one_out:
        return leaving_one_out.leave_one_out(stations, method=method, pairs=pairs)
    return verify(stations, counts=counts, method=method, pairs=pairs)


def to_plan(
    count: int,
    *,
    distance: float,
    tilt: float,
    setup: Setup | None,
    target: TargetSpec | None,
    calibration: Calibration | None,
    verification: int,
    mount_T_camera: FloatArray | None = None,
    reference_T_target: FloatArray | None = None,
    options: PlanOptions | None = None,
) -> Plan:
    """Return stations to visit around a target.

    Args:
        count: Stations to calibrate on.
        distance: From the camera to the aim point, metres.
        tilt: Of the camera's axis away from the target's normal, radians.
        setup: Where the camera is fixed; the calibration's or eye-in-hand when None.
        target: Its centre is the aim point; the target's origin when None.
        calibration: A first answer, from which the robot's poses follow, or None.
        verification: Stations to verify on.
        mount_T_camera: (4, 4) guess of the answer that wins over the calibration's.
        reference_T_target: (4, 4) guess of where the target is that wins over the calibration's.
        options: Noise, limits and what else is wanted; the points of the target, and what the
            calibration knows of camera and noise, are filled in.

    Raises:
        UsageError: A number is out of range, or the setup is not the calibration's.
        UndeterminedError: No place keeps the limits.
    """
    from handeye_cli.plan import plan
    from handeye_cli.planning.options import PlanOptions

    options = options or PlanOptions()
    if target is not None:
        options = replace(options, points=_points(target))
    known = Setup.EYE_IN_HAND
    if calibration is not None:
        known = calibration.setup
        if setup not in (None, known):
            raise UsageError(f"--setup is {setup}, but the calibration is {known}")
        camera = options.camera or calibration.camera
        options = replace(options, known=calibration.noise, camera=camera)
        if mount_T_camera is None:
            mount_T_camera = calibration.mount_T_camera.matrix
        if reference_T_target is None:
            reference_T_target = calibration.reference_T_target.matrix
    return plan(
        count,
        distance=distance,
        tilt=tilt,
        setup=setup or known,
        centre=None if options.points is None else middle_of(options.points),
        mount_T_camera=mount_T_camera,
        reference_T_target=reference_T_target,
        verification=verification,
        options=options,
    )


def to_further_stations(
    record: Any, steps: Steps, count: int, *, options: PlanOptions | None = None
) -> Plan:
    """Return stations to add to those of any record up to the stations.

    Args:
        record: What was recorded.
        steps: How the steps before are run.
        count: Number of stations to add.
        options: Limits, and noise levels that win over those of the recording.

    Raises:
        InputError: The record is of a later stage.
        UsageError: The count is out of range, or a limit needs what is not known.
        UndeterminedError: The recording does not determine the answer, or no place is allowed.
    """
    from handeye_cli.plan import plan_more
    from handeye_cli.planning.options import PlanOptions

    stations = ready_stations(record, steps)
    return plan_more(stations, count, options=options or PlanOptions())


def _points(target: TargetSpec) -> FloatArray:
    from handeye_cli import targets

    return targets.build(target).points()


def _refuse_intrinsics(steps: Steps) -> None:
    if steps.calibrate_intrinsics:
        raise UsageError(
            "--calibrate-intrinsics cannot act on a stations document, whose poses of the target "
            "rest on the intrinsics already",
            hint="give the recording or its features document",
        )


def with_target(record: Any, target: TargetSpec) -> Any:
    """Return the record with another target, as a flag that wins over the document.

    Raises:
        UsageError: What the record holds was found with its own target and would not change.
    """
    if isinstance(record, Recording):
        return replace(record, target=target)
    if isinstance(record, Features) and _layout(record.target) == _layout(target):
        return replace(record, target=target)
    raise UsageError(
        f"--target cannot replace the target a {type(record).__name__.lower()} document was made "
        "with; only its lengths can be corrected, and only before the poses are found",
        hint="run again from the recording with this --target",
    )


def _layout(target: TargetSpec) -> tuple[str, dict[str, Any]]:
    counts = {key: value for key, value in target.parameters.items() if not key.endswith("_mm")}
    return target.type, counts


def findings_of(record: Any) -> tuple[Finding, ...]:
    """Return what a record has to say about its data."""
    found: tuple[Finding, ...] = (
        record.findings if isinstance(record, Recording | Features | Stations) else record.diagnosis
    )
    return found
