"""The cell that a user's limits describe."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from handeye_cli.conventions import MM
from handeye_cli.errors import UsageError
from handeye_cli.geometry import se3
from handeye_cli.geometry.camera import normalise, project
from handeye_cli.planning import cell as rules
from handeye_cli.planning import views
from handeye_cli.planning.cell import Cell, Frames, Limit, PairLimit, Places, beyond
from handeye_cli.planning.options import Limits
from handeye_cli.records import Camera, FloatArray

MAX_TILT = math.radians(80.0)
"""Beyond it the target is seen edge on."""
_MARGIN = 0.02
_DIRECTIONS = 360
"""In which the outermost points of a target are looked for."""
_DEG, _PX = ("deg", math.radians(1.0)), ("px", 1.0)
_LENGTH = ("mm", MM)


def cell_of(
    limits: Limits,
    frames: Frames,
    *,
    cameras_of: Callable[[FloatArray], FloatArray],
    aim: FloatArray,
    distance: tuple[float, float],
    points: FloatArray | None,
    camera: Camera | None,
    recorded: FloatArray | None = None,
) -> Cell:
    """Return the cell with these limits.

    Args:
        limits: What every station has to keep.
        frames: What leads from the camera to the robot.
        cameras_of: (K, 4, 4) target_T_camera of (K, 6) views.
        aim: (3,) point of the target the cameras turn about, metres.
        distance: Smallest and largest distance from it, metres.
        points: (n, 3) points of the target, or None.
        camera: The intrinsics, or None.
        recorded: (M, 3, 3) rotations of stations that stay, or None.

    Raises:
        UsageError: A limit needs something that is not known.
    """
    _require(limits, frames, points, camera)
    far = distance[1]
    away = Limit(
        "distance", _LENGTH, far, lambda at: beyond(at.views[:, views.DISTANCE], *distance)
    )
    seen = _of_views(limits, aim, far, points, camera)
    single = [away, *seen, *_of_grippers(limits, far)]
    return Cell(cameras_of, frames, tuple(single), tuple(_of_pairs(limits)), recorded)


def _require(
    limits: Limits, frames: Frames, points: FloatArray | None, camera: Camera | None
) -> None:
    robot = {
        "--box": limits.box,
        "--reach": limits.reach,
        "--cone": limits.cone,
        "--avoid-axis": limits.avoid_axis,
    }
    for flag, value in robot.items():
        if value is not None and (
            frames.mount_T_camera is None or frames.reference_T_target is None
        ):
            raise UsageError(
                f"{flag} limits the gripper, whose poses are not known",
                hint="give guesses of where the camera and the target are: --calibration and, "
                "where that does not say it, --base-T-target",
            )
    if limits.margin is not None and (points is None or camera is None):
        raise UsageError(
            f"--margin-px {limits.margin:g} needs to know what the camera sees",
            hint="give --target, and --camera or a --calibration with intrinsics",
        )


def _of_views(
    limits: Limits,
    aim: FloatArray,
    distance: float,
    points: FloatArray | None,
    camera: Camera | None,
) -> Iterator[Limit]:
    tilt = MAX_TILT if limits.max_tilt is None else limits.max_tilt
    yield Limit("max-tilt", _DEG, 1.0, lambda at: beyond(views.tilts(at.views), 0.0, tilt))
    if limits.max_roll is not None:
        roll = limits.max_roll
        yield Limit("max-roll", _DEG, 1.0, lambda at: beyond(views.rolls(at.views), 0.0, roll))
    points = None if points is None else outer_points(points)
    if limits.depth is not None:
        seen = aim[None] if points is None else points
        yield Limit("depth", _LENGTH, distance, _depth(limits.depth, seen))
    if points is not None and camera is not None:
        margin = _MARGIN * camera.width if limits.margin is None else limits.margin
        yield Limit("view", _PX, float(camera.width), _view(points, camera, margin))


def outer_points(points: FloatArray) -> FloatArray:
    """Return those of (n, 3) points of a plane between which all others lie.

    Where they are in view, and deep enough, the others are too.
    """
    angles = np.arange(_DIRECTIONS) * (2.0 * np.pi / _DIRECTIONS)
    along = points[:, :2] @ np.stack([np.cos(angles), np.sin(angles)])
    size = np.ptp(points[:, :2]) + 1e-300
    return points[np.any(along >= along.max(axis=0) - 1e-9 * size, axis=1)]


def _depth(depth: tuple[float, float], points: FloatArray) -> Callable[[Places], FloatArray]:
    return lambda places: np.max(beyond(rules.depths(places, points), *depth), axis=1)


def _view(points: FloatArray, camera: Camera, margin: float) -> Callable[[Places], FloatArray]:
    widest = _widest(camera)
    low = np.full(2, margin)
    high = np.array([camera.width, camera.height]) - 1.0 - margin

    def excess(places: Places) -> FloatArray:
        here = se3.transform_points(se3.inverse(places.cameras), points)
        pixels = project(here, camera.parameters, camera.model)
        aside = np.hypot(here[..., 0], here[..., 1])
        # beyond the image a lens model may fold back: there the model without distortion counts
        folded = ~(aside <= widest * here[..., 2])
        pixels[folded] = project(here[folded], camera.parameters[:4])
        outside = np.max(np.maximum(low - pixels, pixels - high), axis=-1)
        behind = (here[..., 2] <= 0.0) | ~np.isfinite(outside)
        lost = np.where(folded, np.maximum(outside, 1.0), np.maximum(outside, 0.0))
        return np.asarray(np.max(np.where(behind, 10.0 * camera.width, lost), axis=1))

    return excess


def _widest(camera: Camera) -> float:
    """Return the tangent of the widest angle to the optical axis that the image shows."""
    sides = [np.linspace(0.0, size - 1.0, 17) for size in (camera.width, camera.height)]
    pixels = np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)
    directions = normalise(pixels, camera.parameters, camera.model)
    return 1.001 * float(np.nanmax(np.linalg.norm(directions, axis=-1)))


def _of_grippers(limits: Limits, distance: float) -> Iterator[Limit]:
    if limits.box is not None:
        yield Limit("box", _LENGTH, distance, rules.outside_box(limits.box))
    if limits.reach is not None:
        yield Limit("reach", _LENGTH, distance, rules.out_of_reach(limits.reach))
    if limits.cone is not None:
        excess = rules.outside_cone(limits.cone[:3], float(limits.cone[3]))
        yield Limit("cone", _DEG, 1.0, excess)


def _of_pairs(limits: Limits) -> Iterator[PairLimit]:
    if limits.avoid_axis is not None:
        yield rules.rotation_about(*limits.avoid_axis)
    if limits.min_rotation is not None:
        yield rules.too_little_rotation(limits.min_rotation)
