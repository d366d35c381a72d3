"""Which places of the camera a cell allows: each place by itself, and any two together.

A limit says by how much a place breaks it, zero where it is kept. So the nearest allowed place can
be searched for, and the limit that stands in the way can be named with a number.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3, station_generator
from handeye_cli.records import FloatArray, IntArray

Pose = FloatArray


@dataclass(frozen=True)
class Places:
    """K places of the camera, and of the gripper where it is known.

    Attributes:
        views: (K, 6) as `views` describes them.
        cameras: (K, 4, 4) target_T_camera.
        grippers: (K, 4, 4) base_T_gripper, or None when no guess gives it.
    """

    views: FloatArray
    cameras: FloatArray
    grippers: FloatArray | None

    @property
    def turned(self) -> FloatArray:
        """(K, 3, 3) rotations of the gripper, or of the camera, which turns by the same angles."""
        poses = self.cameras if self.grippers is None else self.grippers
        return poses[:, :3, :3]

    def part(self, rows: IntArray | list[int]) -> Places:
        """Return some of the places."""
        grippers = None if self.grippers is None else self.grippers[rows]
        return Places(self.views[rows], self.cameras[rows], grippers)


@dataclass(frozen=True)
class Limit:
    """Something every place has to keep.

    Attributes:
        name: Short name, such as `box`.
        unit: What people measure it in, and what one of them is in radians, metres or pixels.
        scale: An excess that is as bad as a radian.
        excess: (K,) by how much each of K places breaks it, in radians, metres or pixels.
    """

    name: str
    unit: tuple[str, float]
    scale: float
    excess: Callable[[Places], FloatArray]


@dataclass(frozen=True)
class PairLimit:
    """Something any two stations have to keep.

    Attributes:
        name: Short name, such as `avoid-axis`.
        excess: (K, M) by how much each of K and each of M rotations break it together, radians.
    """

    name: str
    excess: Callable[[FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True)
class Frames:
    """Where things are supposed to be, to turn places of the camera into poses of the robot.

    Attributes:
        setup: Where the camera is fixed.
        mount_T_camera: (4, 4) guess, or None.
        reference_T_target: (4, 4) guess, or None.
    """

    setup: Setup
    mount_T_camera: Pose | None = None
    reference_T_target: Pose | None = None

    def grippers(self, cameras: FloatArray) -> FloatArray | None:
        """Return the (K, 4, 4) base_T_gripper of (K, 4, 4) target_T_camera, or None."""
        if self.mount_T_camera is None or self.reference_T_target is None:
            return None
        return station_generator.robot_poses(
            cameras, self.mount_T_camera, self.reference_T_target, self.setup
        )


@dataclass(frozen=True)
class Cell:
    """Places and what they have to keep.

    Attributes:
        cameras_of: (K, 4, 4) target_T_camera of (K, 6) views.
        frames: What leads from there to the robot.
        limits: Of each place by itself.
        pair_limits: Of any two.
        recorded: Rotations (M, 3, 3) of stations that stay, which the pair limits count as well.
    """

    cameras_of: Callable[[FloatArray], FloatArray]
    frames: Frames
    limits: tuple[Limit, ...] = ()
    pair_limits: tuple[PairLimit, ...] = ()
    recorded: FloatArray | None = None

    @property
    def names(self) -> list[str]:
        """Names of all limits, in the order of the columns of `excess`."""
        return [*(limit.name for limit in self.limits), *(limit.name for limit in self.pair_limits)]

    def places(self, views: FloatArray) -> Places:
        """Return the places of (K, 6) views."""
        cameras = self.cameras_of(views)
        return Places(views, cameras, self.frames.grippers(cameras))

    def excess(self, places: Places, others: FloatArray) -> FloatArray:
        """Return by how much places break each limit, 1 being as bad as a radian.

        Args:
            places: K places.
            others: (M, 3, 3) rotations of the stations they would stand beside.

        Returns:
            (K, limits + pair limits), zero where a limit is kept.
        """
        return np.concatenate(
            [self.excess_alone(places), self.excess_beside(places, others)], axis=1
        )

    def excess_alone(self, places: Places) -> FloatArray:
        """Return the (K, limits) excess over the limits of each place by itself."""
        columns = [limit.excess(places) / limit.scale for limit in self.limits]
        return np.stack(columns, axis=1) if columns else np.zeros((len(places.views), 0))

    def excess_beside(self, places: Places, others: FloatArray) -> FloatArray:
        """Return the (K, pair limits) excess beside (M, 3, 3) rotations and those recorded."""
        if self.recorded is not None:
            others = np.concatenate([self.recorded, others])
        columns = [
            np.max(limit.excess(places.turned, others), axis=1, initial=0.0)
            for limit in self.pair_limits
        ]
        return np.stack(columns, axis=1) if columns else np.zeros((len(places.views), 0))

    def in_words(self, column: int, excess: float) -> str:
        """Return an excess of a column of `excess` in the unit people measure that limit in."""
        if column >= len(self.limits):
            return f"{_three_digits(np.degrees(excess))} deg"
        limit = self.limits[column]
        name, one = limit.unit
        return f"{_three_digits(excess * limit.scale / one)} {name}"


def _three_digits(value: float) -> str:
    return f"{value:.3g}" if value < 1000.0 else f"{value:.0f}"


def beyond(values: FloatArray, low: float, high: float) -> FloatArray:
    """Return by how far values lie outside of a range, zero inside."""
    return np.maximum(np.maximum(low - values, values - high), 0.0)


def too_little_rotation(least: float) -> PairLimit:
    """Return the limit that any two rotations are at least so far apart, radians."""

    def excess(one: FloatArray, other: FloatArray) -> FloatArray:
        # The trace is blind below 1e-8 rad, which is far from any limit.
        traces = one.reshape(-1, 9) @ other.reshape(-1, 9).T
        apart = np.arccos(np.clip((traces - 1.0) / 2.0, -1.0, 1.0))
        return np.maximum(least - apart, 0.0)

    return PairLimit("min-rotation", excess)


def rotation_about(axis: int, most: float) -> PairLimit:
    """Return the limit of the rotation vector's component along a base axis, radians."""

    def excess(one: FloatArray, other: FloatArray) -> FloatArray:
        turn = one[:, None] @ np.swapaxes(other, -1, -2)
        return np.maximum(np.abs(rotations.log(turn)[..., axis]) - most, 0.0)

    return PairLimit("avoid-axis", excess)


def outside_box(box: FloatArray) -> Callable[[Places], FloatArray]:
    """Return how far grippers are from a (2, 3) box of the base, metres."""

    def excess(places: Places) -> FloatArray:
        position = _positions(places)
        outside = np.maximum(np.maximum(box[0] - position, position - box[1]), 0.0)
        return np.asarray(np.linalg.norm(outside, axis=1))

    return excess


def out_of_reach(reach: float) -> Callable[[Places], FloatArray]:
    """Return how far grippers are beyond a distance from the base's origin, metres."""
    return lambda places: np.maximum(np.linalg.norm(_positions(places), axis=1) - reach, 0.0)


def outside_cone(direction: FloatArray, angle: float) -> Callable[[Places], FloatArray]:
    """Return how far the gripper's z axis is turned beyond a cone about a base direction."""
    unit = direction / np.linalg.norm(direction)

    def excess(places: Places) -> FloatArray:
        tool = places.turned[:, :, 2]
        turned = np.arctan2(np.linalg.norm(np.cross(tool, unit), axis=1), tool @ unit)
        return np.asarray(np.maximum(turned - angle, 0.0))

    return excess


def _positions(places: Places) -> FloatArray:
    if places.grippers is None:
        raise ValueError("a limit of the gripper needs the gripper's poses")
    return np.asarray(places.grippers[:, :3, 3])


def depths(places: Places, points: FloatArray) -> FloatArray:
    """Return the (K, n) z of (n, 3) target points in the camera frame, metres."""
    return se3.transform_points(se3.inverse(places.cameras), points)[..., 2]
