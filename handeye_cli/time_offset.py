"""Stage: the time between images and robot poses, and stations of a robot that never pauses.

Both rest on frames along the robot's way. Where it pauses, the time is told and nothing else
changes. Where it does not, the frames are the stations: each gets the robot's pose at the corrected
time. The robot's velocity makes errors of it: of the scatter of the images' times one of each
station's own, and of what the time between images and poses is off by one that all stations share.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from handeye_cli import targets
from handeye_cli.conventions import Setup
from handeye_cli.errors import ConvergenceError, InputError, UndeterminedError
from handeye_cli.extract import extract
from handeye_cli.extrinsics import extrinsics
from handeye_cli.geometry import statistics, time_offset
from handeye_cli.geometry.time_offset import FEWEST_VIEWS, MovingViews, OffsetFit
from handeye_cli.ordering import order_consistently
from handeye_cli.records import Features, Finding, FloatArray, Recording, Station
from handeye_cli.records.moving import MovingFrames, TimeOffset

_REACH = 1.0
"""Largest offset that is looked for, seconds, beside the one that was given."""
_FEWEST = 10
"""Frames with the target in them that an offset is told from."""
_NEAR = 0.02
"""Seconds by which an offset does not change which way a plate is turned."""
_LEAST_SURE = 0.02
"""An offset less certain than this, in seconds, is not told."""
_OTHER_MOTION = 0.05
"""Robot and camera that differ by more than this, in radians, do not tell of one motion."""
_OTHER_AXES = 3.0
"""Multiple of the difference of their angles by which loops stay open that have other axes."""
_SIGNIFICANT = 3.0
_MATTERS = 1e-3
"""Seconds below which no offset is worth a flag, however well it is known."""
_HARMLESS = 0.1
"""Seconds at the ends of a standstill that are not taken for a part of the pause."""
_MS = 1e-3
_OUTSIDE = "the robot's pose at the corrected time is not known"
_MOVE_MORE = (
    "turn the robot about several axes while it goes on, with the target in view, or let it stand "
    "still at every station"
)
_CHECK_SCENE = (
    "check --setup and the direction of the robot's poses, and whether target and camera stay "
    "where they are fixed"
)


@dataclass(frozen=True)
class Measured:
    """What frames in motion say of the time between images and poses.

    Attributes:
        finding: In words.
        offset: The time, or None where they do not tell it.
    """

    finding: Finding
    offset: TimeOffset | None = None


class Doubt(NamedTuple):
    """Why the time is not told.

    Attributes:
        reason: In words.
        advice: What would help.
    """

    reason: str
    advice: str = _MOVE_MORE


def extract_in_motion(
    recording: Recording,
    moving: MovingFrames,
    *,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[Features, Measured]:
    """Find the target in frames of a moving robot, and its poses at the times these were taken.

    Where the offset is not told, the poses stay those of the times as given.

    Args:
        recording: Whatever else belongs to the frames.
        moving: The frames.
        workers: Images looked at at the same time; see `extract`.
        progress: Told (done, all) after each image, or None.

    Raises:
        UsageError: The recording does not name its target, or there are no workers.
        InputError: The target is not valid.
    """
    taken = replace(recording, stations=moving.frames)
    features = extract(taken, workers=workers, progress=progress)
    try:
        fit = fitted(lambda offset: _views(features, moving, offset))
    except (UndeterminedError, ConvergenceError, InputError) as error:
        fit = Doubt(error.message)
    stations = features.stations
    if isinstance(fit, Doubt):
        measured = Measured(_untold(fit, applied=moving.are_stations))
    else:
        measured = _measured(fit, moving)
        stations = _corrected(features, moving, fit)
    return replace(
        features,
        stations=tuple(stations[index] for index in moving.stations),
        findings=(*features.findings, measured.finding),
    ), measured


def fitted(views_at: Callable[[float], MovingViews]) -> OffsetFit | Doubt:
    """Return the offset that views tell, or why they tell none.

    Args:
        views_at: Gives the views for an offset in seconds at which the robot's poses say which way
            the target is turned.
    """
    views = views_at(0.0)
    if len(views.times) < _FEWEST:
        return Doubt(f"fewer than {_FEWEST} frames in motion show the target")
    offset = time_offset.rough_offset(views, _REACH)
    if abs(offset) > _NEAR:
        # which way a plate is turned was decided by the robot's poses of another time
        views = views_at(offset)
    apart = time_offset.angles_apart(views, offset)
    known = apart[np.isfinite(apart)]
    if len(known) < FEWEST_VIEWS:
        return _outside(len(apart), len(known))
    angles = statistics.median(known)
    if angles > _OTHER_MOTION:
        return _other_motion(angles)
    fit = time_offset.estimate(views, offset)
    if fit is None:
        return Doubt(f"fewer than {FEWEST_VIEWS} frames agree on one motion", _CHECK_SCENE)
    return _doubt(fit, angles) or fit


def _outside(frames: int, known: int) -> Doubt:
    return Doubt(
        f"the robot's poses are known at the times of {known} of {frames} frames that show the "
        "target",
        "record the robot's poses as long as the images, and both with the time of one clock",
    )


def _other_motion(apart: float) -> Doubt:
    """Return what is to be said of robot and camera whose turns differ by some angle, radians."""
    return Doubt(
        f"at none within {_REACH:g} s do robot and camera make the same motions: between frames "
        f"they turn by angles that are {math.degrees(apart):.1f} deg apart",
        "check that images and robot poses are of one run and one clock; where they are farther "
        "apart, say roughly by how much with --time-offset",
    )


def _views(features: Features, moving: MovingFrames, offset: float) -> MovingViews:
    """Return the target's poses, read with the help of the robot's; those as given have been used.

    Raises:
        UndeterminedError: No frame shows the target, or the intrinsics are not determined.
        InputError: Neither intrinsics nor the size of the images are known.
        ConvergenceError: The intrinsics did not converge.
    """
    if offset:
        poses = moving.path.at(moving.times + offset)
        features = replace(features, stations=tuple(map(_posed, features.stations, poses)))
        board = targets.build(features.target)
        features = order_consistently(features, board.points(), board.turns())
    seen = extrinsics(features).stations
    found = [(i, each.camera_T_target) for i, each in enumerate(seen) if each.camera_T_target]
    return MovingViews(
        path=moving.path,
        inverted=features.setup is Setup.EYE_TO_HAND,
        times=moving.times[[i for i, _ in found]],
        B=np.array([pose.matrix for _, pose in found]).reshape(-1, 4, 4),
        covariance=np.array([pose.covariance for _, pose in found]).reshape(-1, 6, 6),
    )


def _posed(station: Station, pose: FloatArray) -> Station:
    return replace(station, base_T_gripper=pose)


def _corrected(features: Features, moving: MovingFrames, fit: OffsetFit) -> tuple[Station, ...]:
    """Return the stations with the robot's poses at the corrected times, and how sure these are."""
    times = moving.times + fit.offset
    poses, velocities = moving.path.at(times), moving.path.velocities(times)
    own = fit.variances[2] * velocities[:, :, None] * velocities[:, None, :]
    rows = zip(poses, own, fit.sigma * velocities, strict=True)
    return tuple(
        replace(station, base_T_gripper=pose, robot_covariance=covariance, shared_error=error)
        if known
        else replace(station, observation=None, reason=_OUTSIDE)
        for station, (pose, covariance, error), known in zip(
            features.stations, rows, moving.path.covers(times), strict=True
        )
    )


def _doubt(fit: OffsetFit, angles: float) -> Doubt | None:
    """Return why an estimate says nothing, or None where it does.

    Args:
        fit: The estimate.
        angles: Difference of the angles that robot and camera turn by, radians.
    """
    apart = math.sqrt(fit.variances[0])
    if apart > max(_OTHER_MOTION, _OTHER_AXES * angles):
        return Doubt(
            "robot and camera turn by the same angles, but about axes that do not fit together: "
            f"the poses are {math.degrees(apart):.1f} deg apart",
            _CHECK_SCENE,
        )
    if fit.sigma > _LEAST_SURE:
        return Doubt(f"the motion leaves it open by {fit.sigma / _MS:.0f} ms")
    if not fit.converged:
        return Doubt("its estimation did not converge")
    return None


def _measured(fit: OffsetFit, moving: MovingFrames) -> Measured:
    offset = TimeOffset(
        offset=moving.given + fit.offset,
        sigma=fit.sigma,
        jitter=fit.jitter,
        frames=int(np.count_nonzero(fit.used)),
        given=moving.given,
    )
    return Measured(_finding(offset, applied=moving.are_stations), offset)


def _finding(offset: TimeOffset, *, applied: bool) -> Finding:
    """Return what is to be said of an offset that is told."""
    digits = min(max(-math.floor(math.log10(offset.sigma / _MS)), 0), 3)
    found, sigma = (f"{value / _MS:.{digits}f}" for value in (abs(offset.offset), offset.sigma))
    of_poses = f"by {found} +- {sigma} ms, seen in {offset.frames} frames in motion"
    way = "lag behind" if offset.offset < 0.0 else "run ahead of"
    message = f"images {way} the robot's poses {of_poses}"
    change = offset.offset - offset.given
    if abs(change) < max(_SIGNIFICANT * offset.sigma, _MATTERS):
        return Finding("time-offset", "info", message)
    flag = f"--time-offset {offset.offset / _MS:.{digits}f}ms"
    if applied:
        return Finding("time-offset", "info", f"{message}; this is put right", f"{flag} says it")
    if abs(change) < _HARMLESS:
        advice = f"{flag} puts it right; what is seen in pauses is right without"
        return Finding("time-offset", "info", message, advice)
    return Finding("time-offset", "warning", message, f"{flag} puts it right")


def _untold(doubt: Doubt, *, applied: bool) -> Finding:
    return Finding(
        "time-offset-unknown",
        "warning" if applied else "info",
        f"the time between images and poses is not told: {doubt.reason}",
        doubt.advice,
    )
