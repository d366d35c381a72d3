"""The observations of a target over all stations as padded arrays, ready for batched kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handeye_cli.conventions import Setup
from handeye_cli.errors import InputError
from handeye_cli.geometry import pnp, se3
from handeye_cli.records import Camera, FloatArray, IntArray, Station


@dataclass(frozen=True)
class Views:
    """What N usable stations saw of a target's n points.

    Attributes:
        index: (N,) position of each view's station in the document.
        base_T_gripper: (N, 4, 4) robot poses.
        seen: The target's points and their pixels in N views.
    """

    index: IntArray
    base_T_gripper: FloatArray
    seen: pnp.Sightings

    def reference_R_mount(self, setup: Setup) -> FloatArray:
        """Return the (N, 3, 3) rotations of the mount in the reference frame."""
        poses = self.base_T_gripper
        chain = poses if setup is Setup.EYE_IN_HAND else se3.inverse(poses)
        return chain[:, :3, :3]

    def degrees_of_freedom(self, parameters: int = 0) -> int:
        """Return residuals minus unknowns with six per pose and `parameters` shared ones."""
        return 2 * int(self.seen.mask.sum()) - 6 * len(self.index) - parameters


@dataclass(frozen=True)
class PoseCandidates:
    """Both planar poses of each view.

    Attributes:
        poses: (N, 2, 4, 4) camera_T_target, the better one first; the identity where no pose puts
            the target in front of the camera.
        penalties: (N, 2) chi-square above the better one; infinite where there is no second pose.
    """

    poses: FloatArray
    penalties: FloatArray


def views_of(stations: Sequence[Station], points: FloatArray) -> Views:
    """Collect the stations that saw enough of the target; the others have a reason already.

    Args:
        stations: Stations of a features or stations document.
        points: (n, 3) target points in metres.

    Raises:
        InputError: A station has points that the target has not.
    """
    require_points_of_target(stations, len(points))
    usable = [
        (i, station, station.observation)
        for i, station in enumerate(stations)
        if station.observation is not None and len(station.observation.ids) >= pnp.MIN_POINTS
    ]
    pixels = np.zeros((len(usable), len(points), 2))
    mask = np.zeros((len(usable), len(points)), dtype=bool)
    for row, (_, _, seen) in enumerate(usable):
        pixels[row, seen.ids] = seen.pixels
        mask[row, seen.ids] = True
    poses = [station.base_T_gripper for _, station, _ in usable]
    return Views(
        index=np.array([i for i, _, _ in usable], dtype=int),
        base_T_gripper=np.array(poses).reshape(-1, 4, 4),
        seen=pnp.Sightings(points, pixels, mask),
    )


def pose_candidates(views: Views, camera: Camera) -> PoseCandidates:
    """Fit both planar poses to every view.

    The pixel variance that turns residuals into chi-square is the median over the views, so that
    one bad view does not make the others' evidence look weak.
    """
    found = pnp.planar_poses(views.seen, camera.lens)
    possible = np.isfinite(found.squares[:, 0])
    freedom = np.maximum(2 * views.seen.mask.sum(axis=1) - 6, 1)
    spread = found.squares[possible, 0] / freedom[possible]
    variance = max(float(np.median(spread)), 1e-12) if len(spread) else 1.0
    two = found.distinct & possible
    extra = np.subtract(found.squares[:, 1], found.squares[:, 0], where=two, out=np.zeros(len(two)))
    penalties = np.stack([np.zeros(len(two)), np.where(two, extra / variance, np.inf)], axis=1)
    poses = np.where(possible[:, None, None, None], found.poses, np.eye(4))
    return PoseCandidates(poses, penalties)


def require_points_of_target(stations: Sequence[Station], count: int) -> None:
    """Check that stations saw no other points than the `count` ones of their target.

    Raises:
        InputError: A station has an id beyond them.
    """
    for station in stations:
        largest = -1 if station.observation is None else max(station.observation.ids, default=-1)
        if largest >= count:
            raise InputError(
                f"expected ids of the {count} points of the target, 0 to {count - 1}, "
                f"found {largest}",
                where=f'station "{station.name}"',
                hint="the points were found with another target, or their numbers start at 1",
            )
