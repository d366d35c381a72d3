"""Which stations to add to those that were recorded, and what each of them will gain."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from handeye_cli import what_if
from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.planning import prediction, views
from handeye_cli.planning.cell import Frames
from handeye_cli.planning.design import Problem, design
from handeye_cli.planning.lasting import findings_of
from handeye_cli.planning.levels import CAMERA_LEVELS, ROBOT_LEVELS, source_of
from handeye_cli.planning.limits import MAX_TILT, cell_of
from handeye_cli.planning.options import PlanOptions
from handeye_cli.planning.prediction import UncertainRig
from handeye_cli.planning.recorded import Recorded, solved
from handeye_cli.planning.uncertain_sight import UncertainSight
from handeye_cli.records import Finding, FloatArray, Noise, PredictedError, Stations
from handeye_cli.records.planning import Gain, PlanBasis
from handeye_cli.sight import Sight


@dataclass(frozen=True)
class Additions:
    """Stations that are worth most beside those that were recorded.

    Attributes:
        cameras: (n, 4, 4) target_T_camera.
        grippers: (n, 4, 4) base_T_gripper.
        predicted_error: Of a calibration on all stations together.
        gains: What each of the new ones adds, in their order.
        noise: The levels this rests on.
        basis: Where they come from.
        findings: What there is to say of the recording, and of what new stations do not change.
    """

    cameras: FloatArray
    grippers: FloatArray
    predicted_error: PredictedError
    gains: tuple[Gain, ...]
    noise: Noise
    basis: PlanBasis
    findings: tuple[Finding, ...]


def next_best(
    stations: Stations, names: Sequence[str], options: PlanOptions, *, method: str
) -> Additions:
    """Choose stations to record beside those that are there.

    New places look at the target from as near and as far as the recorded ones and are tilted by no
    more, unless limits of depth and tilt say otherwise. The answer is taken from the recording; the
    robot's noise is that of its calibration, the camera's that of its pixels where they are known.
    What is there is predicted as solving it does. New stations look through the same intrinsics,
    whose error stays but for what their own pixels say of it. At new places the robot stands still:
    an error that recorded poses share, as that of a time offset, is not theirs, and moves the
    answer the less the more of them there are. What is no noise at all is taken to stay.

    Args:
        stations: What was recorded.
        names: A name for each new station.
        options: Limits, and noise levels that win over those of the calibration.
        method: A row of the table of solvers, for the answer.

    Raises:
        UndeterminedError: The recording does not determine the answer, or no place is allowed.
        UsageError: A limit needs what is not known.
    """
    recorded = solved(stations, options.given, method=method)
    problem, grid = _problem(recorded, options)
    chosen = design(problem, len(names), grid, None)
    chosen = _best_first(problem, chosen)
    cameras = problem.cell.cameras_of(chosen)
    rows = recorded.rig.rows(cameras)
    counts = range(len(names) + 1)
    steps = [recorded.information + prediction.information(rows[:, :k]) for k in counts]
    grippers = problem.cell.frames.grippers(cameras)
    if grippers is None:
        raise ValueError("a calibration gives the gripper's poses")
    error = prediction.error_of(steps[-1], pull=recorded.pull, lasting=recorded.lasting)
    return Additions(
        cameras,
        grippers,
        error,
        _gains(names, steps, recorded),
        recorded.noise,
        _basis(recorded.rig, options.given),
        findings_of(recorded, error, len(names)),
    )


def _basis(rig: UncertainRig, given: Noise) -> PlanBasis:
    pixels = isinstance(rig.camera_covariance, Sight | UncertainSight)
    camera = "pixels" if pixels else source_of(given, CAMERA_LEVELS, "recording")
    return PlanBasis(source_of(given, ROBOT_LEVELS, "recording"), camera, "recording")


def _gains(
    names: Sequence[str], steps: Sequence[FloatArray], recorded: Recorded
) -> tuple[Gain, ...]:
    lasting = se3.by_kind(np.diag(recorded.lasting))[::-1]
    squares = [prediction.mean_squares(each, recorded.pull) + lasting for each in steps]
    errors = [np.sqrt(each).tolist() for each in squares]
    return tuple(
        Gain(name, *before, *after)
        for name, (before, after) in zip(names, pairwise(errors), strict=True)
    )


def _problem(recorded: Recorded, options: PlanOptions) -> tuple[Problem, FloatArray]:
    """Return what the design minimises, and the (K, 6) places to choose from."""
    limits, B = options.limits, recorded.chain.B
    setup = recorded.rig.setup
    frames = Frames(setup, recorded.rig.X[0], recorded.rig.Z[0])
    away = what_if.distances(B, recorded.centre)
    near, far = limits.depth or (float(away.min()), float(away.max()))
    tilt = min(float(what_if.tilts(B, recorded.centre).max()), MAX_TILT)
    tilt = tilt if limits.max_tilt is None else limits.max_tilt
    least = math.radians(10.0) if limits.min_rotation is None else limits.min_rotation
    mounts = recorded.chain.A if setup is Setup.EYE_IN_HAND else se3.inverse(recorded.chain.A)
    seen = recorded.seen
    cell = cell_of(
        replace(limits, max_tilt=tilt + 1e-9, min_rotation=least),
        frames,
        cameras_of=_cameras_like(B, recorded.centre),
        aim=recorded.centre,
        distance=(near, far),
        points=None if seen is None else seen.points,
        camera=None if seen is None else seen.camera,
        recorded=mounts[:, :3, :3],
    )
    roll = math.pi if limits.max_roll is None else limits.max_roll
    aside = 0.0 if seen is None else 0.1
    free = np.array([0.2, 0.2, min(0.5, roll), 0.25 * (far - near), aside, aside])
    weights = 1.0 / prediction.mean_squares(recorded.information, recorded.pull)
    problem = Problem(recorded.rig, cell, weights, recorded.information, free, recorded.pull)
    return problem, views.grid(tilt, roll, near, far)


def _cameras_like(B: FloatArray, centre: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Return the cameras of views on the side of the target, and about the roll, of (N, 4, 4) B."""
    target_T_camera = se3.inverse(B)
    front = np.mean(target_T_camera[:, 2, 3] - centre[2]) <= 0.0
    side = np.diag([1.0, 1.0, 1.0] if front else [1.0, -1.0, -1.0])
    M = side @ rotations.mean(target_T_camera[:, :3, :3])
    turn = rotations.exp(np.array([0.0, 0.0, np.arctan2(M[1, 0] - M[0, 1], M[0, 0] + M[1, 1])]))
    target_T_aim = se3.from_parts(side @ turn, centre)

    def cameras_of(at: FloatArray) -> FloatArray:
        return np.asarray(target_T_aim @ views.cameras_of(at, np.zeros(3)))

    return cameras_of


def _best_first(problem: Problem, chosen: FloatArray) -> FloatArray:
    """Return stations so ordered that each is the one worth most beside those before it."""
    rows = problem.rig.rows(problem.cell.cameras_of(chosen))
    gathered, left, order = problem.recorded, list(range(len(chosen))), []
    while left:
        figures = problem.with_one_more(gathered, rows[:, left])
        order.append(left.pop(int(np.argmin(figures))))
        gathered = gathered + prediction.information(rows[:, order[-1:]])
    return chosen[order]
