"""Where cameras, grippers and plates stood, as lines in space: the paper's figure 6."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli import targets
from handeye_cli.conventions import Setup
from handeye_cli.geometry import se3
from handeye_cli.geometry.extent import middle_of
from handeye_cli.geometry.star import star_pairs
from handeye_cli.records import (
    Calibration,
    Camera,
    FloatArray,
    IntArray,
    Plan,
    Stations,
    TargetSpec,
)
from handeye_cli.reporting.case import Case

_SIZE = 0.18
"""Length of a camera or gripper in a picture, over the radius of the scene."""
_BARE_PLATE = 0.2
"""Half the side of a plate whose size nobody told, over the radius of the scene."""
_FAR = 2.5
"""The robot's base is shown where it is within this many radii of the middle."""
_FROM = -58.0
"""Azimuth that moving cameras are looked at from, degrees."""
_MOST = 100
"""Stations that are shown; of more, evenly chosen ones."""
_VIEW = (0.5, 0.4)
"""Half the width and height of a picture over the focal length, where there are no intrinsics."""


@dataclass(frozen=True)
class Scene:
    """Lines in space, metres.

    Attributes:
        frame: The frame it is in, `base` or `target`.
        names: Of the k stations.
        places: (k, 3) where each station's moving camera or plate is.
        used: (k,) whether the answer rests on it.
        cameras: (c, 8, 2, 3) edges of the cameras' pyramids of sight.
        grippers: (g, 3, 2, 3) axes x, y and z of the gripper's frames.
        base: (b, 3, 2, 3) axes of the robot's base, if it is near.
        plates: (p, 4, 3) corners of the plates.
        pairs: (m, 2, 3) bars between the stations of interstation pairs.
        low: (3,) lower corner of a box around all of it.
        high: (3,) upper corner.
        azimuth: From which side nothing hides behind the rest, degrees about z from x.
        total: Number of stations; of very many only some are among the k.
    """

    frame: str
    names: tuple[str, ...]
    places: FloatArray
    used: NDArray[np.bool_]
    cameras: FloatArray
    grippers: FloatArray
    base: FloatArray
    plates: FloatArray
    pairs: FloatArray
    low: FloatArray
    high: FloatArray
    azimuth: float
    total: int


@dataclass(frozen=True)
class _Frames:
    """Poses in one frame: (., 4, 4) each."""

    frame: str
    cameras: FloatArray
    plates: FloatArray
    grippers: FloatArray


@dataclass(frozen=True)
class _Visits:
    """The stations: k names, which are used, and (m, 2) their pairs by row; how many there are."""

    names: tuple[str, ...]
    used: NDArray[np.bool_]
    pairs: IntArray
    total: int


def scene_of(case: Case) -> Scene | None:
    """Return the stations of a case: in the robot's base where an answer is known, else the target.

    None where no pose of a station is known.
    """
    stations = case.stations
    if stations is None or all(each.camera_T_target is None for each in stations.stations):
        return None
    posed = np.array([i for i, each in enumerate(stations.stations) if each.camera_T_target])
    rows = posed[_some(len(posed))]
    frames = _measured(stations, rows) if case.calibration is None else _solved(
        stations, rows, case.calibration
    )  # fmt: skip
    names = tuple(stations.stations[i].name for i in rows)
    used = _used(names, case.calibration)
    visits = _Visits(names, used, _pairs(names, used, case.calibration), len(posed))
    return _scene(frames, visits, stations.target, stations.camera)


def scene_of_plan(plan: Plan, target: TargetSpec | None = None) -> Scene:
    """Return the stations of a plan around its target.

    Args:
        plan: Where to go.
        target: What the plate looks like, if that is known.
    """
    rows = _some(len(plan.stations))
    chosen = [plan.stations[i] for i in rows]
    cameras = np.stack([each.target_T_camera for each in chosen])
    frames = _Frames("target", cameras, np.eye(4)[None], np.zeros((0, 4, 4)))
    names = tuple(each.name for each in chosen)
    used = np.array([each.purpose == "calibrate" for each in chosen])
    pairs = _by_row(rows, plan.pairs)
    return _scene(frames, _Visits(names, used, pairs, len(plan.stations)), target, None)


def _some(count: int) -> IntArray:
    """Return evenly chosen ones of so many stations, all of them where they are not too many."""
    picked = np.linspace(0, count - 1, min(count, _MOST)).round()
    return np.unique(picked.astype(np.int64))


def _by_row(rows: IntArray, pairs: Sequence[tuple[int, int]]) -> IntArray:
    """Return the (m, 2) rows of pairs of stations, without the pairs of which one is not there."""
    row_of = {int(station): row for row, station in enumerate(rows)}
    kept = [(row_of[i], row_of[j]) for i, j in pairs if i in row_of and j in row_of]
    return np.array(kept, dtype=np.int64).reshape(-1, 2)


def _measured(stations: Stations, rows: IntArray) -> _Frames:
    poses = [stations.stations[i].camera_T_target for i in rows]
    cameras = se3.inverse(np.stack([pose.matrix for pose in poses if pose is not None]))
    return _Frames("target", cameras, np.eye(4)[None], np.zeros((0, 4, 4)))


def _solved(stations: Stations, rows: IntArray, answer: Calibration) -> _Frames:
    grippers = np.stack([stations.stations[i].base_T_gripper for i in rows])
    X, Z = answer.mount_T_camera.matrix, answer.reference_T_target.matrix
    if answer.setup is Setup.EYE_IN_HAND:
        return _Frames("base", grippers @ X, Z[None], grippers)
    return _Frames("base", X[None], grippers @ Z, grippers)


def _used(names: tuple[str, ...], answer: Calibration | None) -> NDArray[np.bool_]:
    if answer is None:
        return np.ones(len(names), dtype=bool)
    used = {each.name: each.used for each in answer.stations}
    return np.array([used.get(name, False) for name in names])


def _pairs(names: tuple[str, ...], used: NDArray[np.bool_], answer: Calibration | None) -> IntArray:
    """Return the (m, 2) interstation pairs by row: the answer's, or those of the star drawing."""
    if answer is not None:
        row_of = {name: row for row, name in enumerate(names)}
        rows = np.array([row_of.get(each.name, -1) for each in answer.stations])
        pairs = rows[np.array(answer.pairs, dtype=np.int64).reshape(-1, 2)]
        return pairs[np.all(pairs >= 0, axis=1)]
    chosen = np.flatnonzero(used)
    return chosen[star_pairs(len(chosen))] if len(chosen) >= 3 else np.zeros((0, 2), dtype=np.int64)


def _scene(
    frames: _Frames, visits: _Visits, target: TargetSpec | None, camera: Camera | None
) -> Scene:
    moving = frames.cameras if len(frames.cameras) == len(visits.names) else frames.plates
    places = moving[:, :3, 3]
    middle, radius = _ball(np.concatenate([frames.cameras, frames.plates, frames.grippers]))
    size = _SIZE * radius
    near = frames.frame == "base" and float(np.linalg.norm(middle)) < _FAR * radius
    base = _axes(np.eye(4)[None] if near else np.zeros((0, 4, 4)), 1.5 * size)
    corners = se3.transform_points(frames.plates, _outline(target, _BARE_PLATE * radius))
    centres = [each[:, :3, 3] for each in (frames.cameras, frames.grippers)]
    around = np.concatenate([*centres, corners.reshape(-1, 3), base[:, 0, 0]])
    return Scene(
        frame=frames.frame,
        names=visits.names,
        places=places,
        used=visits.used,
        cameras=_pyramids(frames.cameras, camera, size),
        grippers=_axes(frames.grippers, 0.8 * size),
        base=base,
        plates=corners,
        pairs=places[visits.pairs],
        low=around.min(axis=0) - size,
        high=around.max(axis=0) + size,
        azimuth=_azimuth(frames),
        total=visits.total,
    )


def _azimuth(frames: _Frames) -> float:
    """Return a side to look from: across the line of sight of a camera that stands still."""
    if len(frames.cameras) > 1:
        return _FROM
    x, y, _ = frames.plates[:, :3, 3].mean(axis=0) - frames.cameras[0, :3, 3]
    return float(np.degrees(np.arctan2(y, x))) - 100.0


def _ball(poses: FloatArray) -> tuple[FloatArray, float]:
    places = poses[:, :3, 3]
    middle = middle_of(places)
    radius = float(np.max(np.linalg.norm(places - middle, axis=1)))
    return middle, radius or 1.0


def _outline(target: TargetSpec | None, half: float) -> FloatArray:
    """Return the (4, 3) corners of a plate in its own frame."""
    low, high = np.full(2, -half), np.full(2, half)
    if target is not None:
        board = targets.build(target)
        drawing, points = board.drawing(), board.points()[:, :2]
        low, high = points.min(axis=0), points.max(axis=0)
        if not drawing.endless:
            low, high = drawing.outline
    (x0, y0), (x1, y1) = low, high
    return np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])


def _pyramids(poses: FloatArray, camera: Camera | None, depth: float) -> FloatArray:
    """Return the (c, 8, 2, 3) edges of what cameras see down to a depth."""
    wide, high = _VIEW
    if camera is not None:
        wide, high = camera.width / camera.fx / 2.0, camera.height / camera.fy / 2.0
    corners = depth * np.array(
        [[-wide, -high, 1.0], [wide, -high, 1.0], [wide, high, 1.0], [-wide, high, 1.0]]
    )
    rays = np.stack([np.zeros((4, 3)), corners], axis=1)
    rim = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    return _moved(poses, np.concatenate([rays, rim]))


def _axes(poses: FloatArray, length: float) -> FloatArray:
    """Return the (g, 3, 2, 3) axes of frames."""
    return _moved(poses, np.stack([np.zeros((3, 3)), length * np.eye(3)], axis=1))


def _moved(poses: FloatArray, lines: FloatArray) -> FloatArray:
    """Return (n, m, 2, 3) lines for (n, 4, 4) poses and (m, 2, 3) lines."""
    points = se3.transform_points(poses, lines.reshape(-1, 3))
    return np.asarray(points.reshape(len(poses), *lines.shape))
