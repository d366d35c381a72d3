"""Where to send the robot: the paper's station generator, section IV-A1, and what goes past it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from handeye_cli.conventions import Setup
from handeye_cli.errors import UsageError
from handeye_cli.geometry import station_generator
from handeye_cli.geometry.star import star_pairs
from handeye_cli.planning import prediction, views
from handeye_cli.planning.cell import Cell, Frames
from handeye_cli.planning.design import Problem, design
from handeye_cli.planning.levels import Supposed, suppose
from handeye_cli.planning.limits import MAX_TILT, cell_of
from handeye_cli.planning.options import Limits, PlanOptions
from handeye_cli.planning.settle import Settled, apart, broken_limits, settle
from handeye_cli.planning.travel import shortest_way
from handeye_cli.records import FloatArray, Plan, PlannedStation, Stations
from handeye_cli.records.planning import CircleError, MovedStation
from handeye_cli.solvers import DEFAULT

MOST_LIMITED = 200
"""Stations that limits are checked for, any two of them beside each other."""
MOST_OPTIMIZED = 50
"""Stations that are chosen one by one."""
MIN_ROTATION = math.radians(10.0)
"""Of the gripper between chosen stations: who repeats a pose repeats its error."""
_RANGE = 4.0
"""A station is moved to at most so many times the distance asked for, or to so small a part."""
_DEFAULTS = PlanOptions()


@dataclass(frozen=True)
class _Task:
    """What is planned, checked and with everything that follows from it."""

    count: int
    distance: float
    tilt: float
    frames: Frames
    aim: FloatArray
    options: PlanOptions
    supposed: Supposed
    names: list[str]

    @property
    def is_limited(self) -> bool:
        """Whether there is anything that a station of the circle could break."""
        seen = self.options.points is not None and self.options.camera is not None
        return seen or any(value is not None for value in vars(self.options.limits).values())

    def cell(self, limits: Limits, distance: tuple[float, float]) -> Cell:
        return cell_of(
            limits,
            self.frames,
            cameras_of=partial(views.cameras_of, aim=self.aim),
            aim=self.aim,
            distance=distance,
            points=self.options.points,
            camera=self.options.camera,
        )

    @property
    def roll(self) -> float:
        return _or_else(self.options.limits.max_roll, math.pi)


def plan(
    count: int,
    *,
    distance: float = 0.17,
    tilt: float = math.radians(30.0),
    setup: Setup = Setup.EYE_IN_HAND,
    centre: FloatArray | None = None,
    mount_T_camera: FloatArray | None = None,
    reference_T_target: FloatArray | None = None,
    verification: int = 0,
    options: PlanOptions = _DEFAULTS,
) -> Plan:
    """Place stations on the paper's circle, or where they are best, and predict the error.

    Stations of the circle that break a limit are moved to the nearest allowed place. With
    `options.optimize` the stations to calibrate with are chosen for the smallest error instead, at
    the same distance, or within the limits of the depth, and tilted by no more.

    Args:
        count: Number of stations to calibrate with, at least 3.
        distance: From the camera to the aim point, metres.
        tilt: Angle between the camera's axis and the plate's normal, radians, at most 80 degrees.
        setup: Where the camera is fixed.
        centre: (3,) aim point in the target frame, metres; the target's origin when None.
        mount_T_camera: (4, 4) guess of the answer; with `reference_T_target` it gives robot poses.
        reference_T_target: (4, 4) guess of where the target is fixed.
        verification: Number of stations to verify with, at most `count`, between the others.
        options: Noise, limits, and whether to optimise.

    Returns:
        The stations, those to calibrate with first; the pairs are indices into these.

    Raises:
        UsageError: A number is out of its range, only one of the two guesses is given, or a limit
            needs what is not known.
        UndeterminedError: No place keeps the limits.
    """
    _check_numbers(count, distance, tilt, verification)
    frames = Frames(setup, mount_T_camera, reference_T_target)
    _require_both(frames)
    task = _Task(
        count,
        distance,
        tilt,
        frames,
        np.zeros(3) if centre is None else np.asarray(centre, dtype=float),
        options,
        suppose(frames, options),
        station_names(count + verification),
    )
    _check_sizes(task)
    between = station_generator.between_angles(count, verification)
    angles = np.concatenate([station_generator.circle_angles(count), between])
    asked = views.circle_views(angles, distance, tilt)
    placed, moved, circle = _placed(task, asked) if _goes_past(task) else (asked, (), None)
    return _finished(task, placed, moved, circle)


def plan_more(
    stations: Stations, count: int, *, options: PlanOptions = _DEFAULTS, method: str = DEFAULT
) -> Plan:
    """Choose stations to record beside those that are there already.

    Args:
        stations: What was recorded.
        count: Number of stations to add, at least 1.
        options: Limits, and noise levels that win over those of the recording.
        method: A row of the table of solvers, for the answer they improve.

    Returns:
        The new stations in the order of their worth, with what each of them gains.

    Raises:
        UsageError: A number is out of its range, or a limit needs what is not known.
        UndeterminedError: The recording does not determine the answer, or no place is allowed.
    """
    from handeye_cli.planning.next_best import next_best

    if not 1 <= count <= MOST_OPTIMIZED:
        raise UsageError(f"expected 1 to {MOST_OPTIMIZED} stations to add, found {count}")
    names = station_names(count, [each.name for each in stations.stations])
    found = next_best(stations, names, options, method=method)
    visited = planned_stations(names, found.cameras, found.grippers, ["calibrate"] * count)
    order = way_through(names, found.cameras, found.grippers) if options.shortest_way else ()
    return Plan(
        stations.setup,
        visited,
        (),
        predicted_error=found.predicted_error,
        noise=found.noise,
        basis=found.basis,
        gains=found.gains,
        order=order,
        diagnosis=found.findings,
    )


def station_names(count: int, taken: Sequence[str] = ()) -> list[str]:
    """Return the names "00", "01", ... of stations, all of one width, after those taken."""
    first = len(taken)
    digits = max(2, len(str(first + count - 1)))
    names = (f"{i:0{digits}d}" for i in range(first, first + count + len(taken)))
    return [name for name in names if name not in taken][:count]


def _goes_past(task: _Task) -> bool:
    return task.options.optimize or task.is_limited


def _placed(
    task: _Task, asked: FloatArray
) -> tuple[FloatArray, tuple[MovedStation, ...], CircleError | None]:
    """Return the places of all stations, which of them were moved, and the circle as asked for."""
    limits, distance = task.options.limits, task.distance
    cell = task.cell(limits, (distance / _RANGE, distance * _RANGE))
    broken = broken_limits(cell, asked)
    circle = _circle_error(task, asked[: task.count], not any(broken[: task.count]))
    if not task.options.optimize:
        settled = settle(cell, asked, _grid(task, distance), task.names)
        return settled.views, _moved(task, asked, settled), circle if any(settled.broken) else None
    chosen = _designed(task, asked[: task.count], circle)
    cell = replace(cell, recorded=cell.places(chosen).turned)
    settled = settle(cell, asked[task.count :], _grid(task, distance), task.names[task.count :])
    placed = np.concatenate([chosen, settled.views])
    everyone = Settled(placed, ((),) * task.count + settled.broken)
    return placed, _moved(task, asked, everyone), circle


def _designed(task: _Task, asked: FloatArray, circle: CircleError | None) -> FloatArray:
    limits = task.options.limits
    near, far = limits.depth or (task.distance, task.distance)
    tight = replace(
        limits,
        max_tilt=min(task.tilt, _or_else(limits.max_tilt, MAX_TILT)),
        min_rotation=_or_else(limits.min_rotation, MIN_ROTATION),
    )
    cell = task.cell(tight, (near, far))
    sees = task.options.points is not None and task.options.camera is not None
    aside = 0.1 if sees else 0.0
    free = np.array([0.2, 0.2, min(0.5, task.roll), 0.25 * (far - near), aside, aside])
    reference = circle or CircleError(1.0, 1.0, False)
    problem = Problem(
        task.supposed.rig,
        cell,
        1.0 / np.square([reference.rotation, reference.translation]),
        np.zeros((len(task.supposed.rig.X), 12, 12)),
        free,
    )
    grid = views.grid(_or_else(tight.max_tilt, task.tilt), task.roll, near, far)
    start = None if any(broken_limits(cell, asked)) else asked
    return design(problem, task.count, grid, start)


def _or_else(value: float | None, default: float) -> float:
    return default if value is None else value


def _grid(task: _Task, distance: float) -> FloatArray:
    """Return places all around, from which the search for an allowed one starts."""
    limits = task.options.limits
    near, far = limits.depth or (0.7 * distance, 1.5 * distance)
    tilt = min(1.3 * task.tilt, _or_else(limits.max_tilt, MAX_TILT))
    return views.grid(tilt, task.roll, near, far)


def _circle_error(task: _Task, asked: FloatArray, allowed: bool) -> CircleError | None:
    cameras = views.cameras_of(asked, task.aim)
    rows = task.supposed.rig.rows(cameras)
    if not np.all(np.isfinite(rows)):
        return None
    rotation, translation = np.sqrt(prediction.mean_squares(prediction.information(rows))).tolist()
    return CircleError(rotation, translation, allowed)


def _moved(task: _Task, asked: FloatArray, settled: Settled) -> tuple[MovedStation, ...]:
    turns, shifts = apart(
        views.cameras_of(settled.views, task.aim), views.cameras_of(asked, task.aim)
    )
    rows = zip(task.names, settled.broken, turns.tolist(), shifts.tolist(), strict=True)
    return tuple(MovedStation(*row) for row in rows if row[1])


def _finished(
    task: _Task, placed: FloatArray, moved: tuple[MovedStation, ...], circle: CircleError | None
) -> Plan:
    cameras = views.cameras_of(placed, task.aim)
    robot = task.frames.grippers(cameras)
    purposes = ["calibrate" if i < task.count else "verify" for i in range(len(cameras))]
    pairs = star_pairs(task.count)
    return Plan(
        task.frames.setup,
        planned_stations(task.names, cameras, robot, purposes),
        tuple((int(i), int(j)) for i, j in pairs),
        predicted_error=prediction.predicted_error(task.supposed.rig, cameras[: task.count], pairs),
        noise=task.supposed.noise,
        basis=task.supposed.basis,
        circle=circle,
        moved=moved,
        order=way_through(task.names, cameras, robot) if task.options.shortest_way else (),
    )


def planned_stations(
    names: Sequence[str], cameras: FloatArray, robot: FloatArray | None, purposes: Sequence[str]
) -> tuple[PlannedStation, ...]:
    """Return stations of a plan.

    Args:
        names: Names of N stations.
        cameras: (N, 4, 4) target_T_camera.
        robot: (N, 4, 4) base_T_gripper, or None.
        purposes: `calibrate` or `verify`.
    """
    return tuple(
        PlannedStation(name, cameras[i], None if robot is None else robot[i], purposes[i])
        for i, name in enumerate(names)
    )


def way_through(
    names: Sequence[str], cameras: FloatArray, robot: FloatArray | None
) -> tuple[str, ...]:
    """Return the names of all stations in the order of least motion; arguments as above."""
    return tuple(names[i] for i in shortest_way(cameras if robot is None else robot))


def _check_numbers(count: int, distance: float, tilt: float, verification: int) -> None:
    if count < 3:
        raise UsageError(
            f"expected at least 3 stations, found {count}",
            hint="two stations leave the answer undetermined (the paper's lemmas VII and IX)",
        )
    if not (math.isfinite(distance) and distance > 0.0):
        raise UsageError(
            f"expected a distance above 0 mm, found {1e3 * distance:g} mm",
            hint="measure from the lens to the aim point on the plate",
        )
    if not 0.0 < tilt <= MAX_TILT:
        raise UsageError(
            f"expected a tilt above 0 and up to 80 deg, found {math.degrees(tilt):g} deg",
            hint="30deg keeps most plates in view",
        )
    if not 0 <= verification <= count:
        raise UsageError(
            f"expected 0 to {count} verification stations, found {verification}",
            hint="they lie half-way between the stations to calibrate with",
        )


def _check_sizes(task: _Task) -> None:
    most = MOST_OPTIMIZED if task.options.optimize else MOST_LIMITED
    if _goes_past(task) and len(task.names) > most:
        raise UsageError(
            f"expected at most {most} stations with limits or --optimize, found {len(task.names)}",
            hint="the circle without limits takes more",
        )


def _require_both(frames: Frames) -> None:
    X, Z, setup = frames.mount_T_camera, frames.reference_T_target, frames.setup
    if (X is None) != (Z is None):
        missing = setup.answer if X is None else setup.constant
        given = setup.constant if X is None else setup.answer
        raise UsageError(
            f"robot poses need guesses of {setup.answer} and {setup.constant}, found only {given}",
            hint=f"give {missing} too, for example both from an earlier calibration document",
        )
