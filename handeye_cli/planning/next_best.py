"""Which stations to add to those that were recorded, and what each of them will gain."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from handeye_cli import what_if
from handeye_cli.chain import Chain, chain_of
from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3, statistics
from handeye_cli.geometry.loop import isotropic_covariance
from handeye_cli.planning import prediction, views
from handeye_cli.planning.cell import Frames
from handeye_cli.planning.design import Problem, design
from handeye_cli.planning.levels import camera_covariance
from handeye_cli.planning.limits import MAX_TILT, cell_of
from handeye_cli.planning.options import PlanOptions
from handeye_cli.planning.prediction import Rig
from handeye_cli.records import Calibration, FloatArray, Noise, PredictedError, Stations
from handeye_cli.records.planning import Gain, PlanBasis
from handeye_cli.sight import Sight, sight_of
from handeye_cli.solve import solve
from handeye_cli.solvers import Solution

_FLOOR = 1e-9


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
    """

    cameras: FloatArray
    grippers: FloatArray
    predicted_error: PredictedError
    gains: tuple[Gain, ...]
    noise: Noise
    basis: PlanBasis


@dataclass(frozen=True)
class _Recorded:
    """A recording that was solved.

    Attributes:
        chain: Its stations.
        rig: The answer and the noise, as for stations to come.
        information: (1, 12, 12) of its stations.
        centre: (3,) point of the target they look at.
        seen: What they see of it, or None where that is unknown.
    """

    chain: Chain
    rig: Rig
    information: FloatArray
    centre: FloatArray
    seen: Sight | None


def next_best(
    stations: Stations, names: Sequence[str], options: PlanOptions, *, method: str
) -> Additions:
    """Choose stations to record beside those that are there.

    New places look at the target from as near and as far as the recorded ones and are tilted by no
    more, unless limits of depth and tilt say otherwise. The answer is taken from the recording; the
    robot's noise is that of its calibration, the camera's that of its pixels where they are known.

    Args:
        stations: What was recorded.
        names: A name for each new station.
        options: Limits, and noise levels that win over those of the calibration.
        method: A row of the table of solvers, for the answer.

    Raises:
        UndeterminedError: The recording does not determine the answer, or no place is allowed.
        UsageError: A limit needs what is not known.
    """
    calibration = solve(stations, method=method)
    noise = _noise(calibration.noise, options.given)
    recorded = _recorded(stations, calibration, noise)
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
    source = "pixels" if isinstance(recorded.rig.camera_covariance, Sight) else "recording"
    return Additions(
        cameras,
        grippers,
        prediction.error_of(steps[-1]),
        _gains(names, steps),
        noise,
        PlanBasis("recording", source, "recording"),
    )


def _noise(found: Noise, given: Noise) -> Noise:
    levels = {name: value for name, value in vars(given).items() if value is not None}
    return replace(found, **levels)


def _gains(names: Sequence[str], steps: Sequence[FloatArray]) -> tuple[Gain, ...]:
    errors = [np.sqrt(prediction.mean_squares(each)).tolist() for each in steps]
    return tuple(
        Gain(name, *before, *after)
        for name, (before, after) in zip(names, pairwise(errors), strict=True)
    )


def _recorded(stations: Stations, calibration: Calibration, noise: Noise) -> _Recorded:
    used = {each.name for each in calibration.stations if each.used}
    kept = tuple(each for each in stations.stations if each.name in used)
    stations = replace(stations, stations=kept)
    chain = chain_of(stations)
    sight = sight_of(stations, chain)
    X, Z = calibration.mount_T_camera.matrix, calibration.reference_T_target.matrix
    robot = isotropic_covariance(
        max(noise.robot_rotation or 0.0, _FLOOR), max(noise.robot_translation or 0.0, _FLOOR)
    )
    by_robot = chain.by_robot @ robot @ np.swapaxes(chain.by_robot, -1, -2)
    rows = prediction.whitened(
        chain.A,
        chain.B,
        Solution(X, Z),
        robot=by_robot,
        camera=_camera_covariances(stations, chain, noise),
    )
    return _Recorded(
        chain,
        Rig(stations.setup, X[None], Z[None], robot, _of_new_ones(stations, sight, noise)),
        prediction.information(rows)[None],
        np.zeros(3) if sight is None else sight.centre,
        sight,
    )


def _camera_covariances(stations: Stations, chain: Chain, noise: Noise) -> FloatArray:
    given = stations.noise or Noise()
    stated = given.camera_rotation is not None or given.camera_translation is not None
    if chain.has_covariance and not stated:
        return chain.camera_covariance
    flat = camera_covariance(replace(noise, pixel=None), None, None)
    return np.broadcast_to(np.asarray(flat), (len(chain.A), 6, 6))


def _of_new_ones(stations: Stations, sight: Sight | None, noise: Noise) -> FloatArray | Sight:
    given = stations.noise or Noise()
    stated = given.camera_rotation is not None or given.camera_translation is not None
    if sight is None or stated:
        return camera_covariance(replace(noise, pixel=None), None, None)
    sigma = noise.pixel if noise.pixel is not None else statistics.median(sight.sigma)
    everything = np.ones((1, len(sight.points)), dtype=bool)
    return Sight(sight.points, everything, sight.camera, np.array([sigma]))


def _problem(recorded: _Recorded, options: PlanOptions) -> tuple[Problem, FloatArray]:
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
    weights = 1.0 / prediction.mean_squares(recorded.information)
    problem = Problem(recorded.rig, cell, weights, recorded.information, free)
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
