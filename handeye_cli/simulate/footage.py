"""What a robot and its camera send while the robot goes through the stations of a recording.

Robot and camera share one clock. The robot tells its true pose, moved by the error that it has at
the stations, between them by a mixture of both errors; so its pose at a pause is the one that the
recording's document would hold. Pictures are sharp however fast the robot goes: they are taken in
no time.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.station_generator import robot_poses
from handeye_cli.recording.transforms import Samples
from handeye_cli.records import Camera, FloatArray, GreyImage, IntArray
from handeye_cli.simulate.motion import SECOND_NS, SpeedLimits, Timetable, along, timetable
from handeye_cli.simulate.recording import (
    RenderedImage,
    SimulatedRecording,
    seed_of,
    target_T_moved,
)

START_NS = 1_700_000_000 * SECOND_NS
"""When every simulated robot arrives at its first station: the same run gives the same bytes."""
WORLD, BASE, GRIPPER = "world", "base_link", "tool0"
"""Names of the frames; the base is where the world is."""
_POSE_DELAY_NS = 2_000_000
"""From a pose's stamp to the time at which it is recorded."""


@dataclass(frozen=True)
class Shooting:
    """How a robot's run is recorded.

    Attributes:
        image_rate: Pictures in a second, at pauses and in motion.
        pose_rate: Poses of the robot in a second.
        pause_ns: Length of the pause at each station.
        limits: How fast the robot may go.
    """

    image_rate: float = 5.0
    pose_rate: float = 100.0
    pause_ns: int = SECOND_NS
    limits: SpeedLimits = field(default_factory=SpeedLimits)


class Footage:
    """A recording's stations visited one after the other, as a camera and a robot tell of it.

    Args:
        simulated: The recording.
        shooting: How it is recorded.

    Attributes:
        timetable: When the robot is where.

    Raises:
        UsageError: The pause or a limit is not above 0; later, when it is needed, a rate.
    """

    def __init__(self, simulated: SimulatedRecording, shooting: Shooting) -> None:
        self._simulated = simulated
        self._shooting = shooting
        self.timetable: Timetable = timetable(
            self._true_robot,
            len(simulated.base_T_gripper),
            pause_ns=shooting.pause_ns,
            start_ns=START_NS,
            limits=shooting.limits,
        )

    def links(self) -> tuple[Samples, ...]:
        """Return the transforms of the robot: its gripper in its base, its base in the world."""
        stamps, told = self._told()
        at_start = self.timetable.arrivals_ns[:1]
        return (
            _samples(WORLD, BASE, at_start, np.eye(4)[None], static=True),
            _samples(BASE, GRIPPER, stamps, told, static=False),
        )

    def _told(self) -> tuple[IntArray, FloatArray]:
        """Return the (m,) stamps and (m, 4, 4) poses base_T_gripper that the robot tells."""
        stamps = self.timetable.ticks(self._shooting.pose_rate)
        places = self.timetable.places(stamps)
        stations = self._simulated.recording.stations
        told = np.stack([station.base_T_gripper for station in stations])
        errors = se3.difference(told, self._simulated.base_T_gripper)
        return stamps, se3.perturb(self._true_robot(places), _mixed(errors, places))

    @property
    def camera(self) -> Camera:
        """The intrinsics of the pictures."""
        return self._simulated.scene.camera

    @property
    def picture_count(self) -> int:
        """How many pictures there are."""
        return len(self.taken[0])

    def pictures(self) -> Iterator[tuple[int, GreyImage]]:
        """Yield the stamps and the pictures, drawn one at a time.

        Raises:
            UsageError: The target is not in front of the camera.
            InputError: The distortion leaves pixels without a direction.
        """
        times, poses = self.taken
        stamps = times + self._simulated.staging.image_lag_ns
        # A robot at rest sees the same light again and again, and drawing it is what takes time.
        light, lit = np.empty(0), np.empty(0)
        for k, (stamp, pose) in enumerate(zip(stamps, poses, strict=True)):
            seed = seed_of(self._simulated.seed, 0, k)
            picture = RenderedImage(f"picture {k}", self._simulated.scene, pose, seed)
            if not np.array_equal(pose, lit):
                light, lit = picture.light(), pose
            yield int(stamp), picture.exposed(light)

    @cached_property
    def taken(self) -> tuple[IntArray, FloatArray]:
        """Return the (m,) times of the pictures and their (m, 4, 4) poses camera_T_target."""
        staging = self._simulated.staging
        times = self.timetable.ticks(self._shooting.image_rate)
        # The first picture comes half a period after the first pose: robots have no pose before.
        times = times + round(SECOND_NS / self._shooting.image_rate / 2)
        times = times[times <= self.timetable.departures_ns[-1]]
        places = self.timetable.places(times)
        station = np.rint(places).astype(np.int64)
        taken = ~staging.missing[station]
        times, places, station = times[taken], places[taken], station[taken]
        places = np.where(places == station, staging.pictured[station], places)
        target_T_camera = along(self._simulated.target_T_camera, places)
        shifted = target_T_moved(staging)[np.rint(places).astype(np.int64)]
        return times, se3.inverse(target_T_camera) @ shifted

    def _true_robot(self, places: FloatArray) -> FloatArray:
        simulated = self._simulated
        setup: Setup = simulated.recording.setup
        cameras = along(simulated.target_T_camera, places)
        return robot_poses(cameras, simulated.mount_T_camera, simulated.reference_T_target, setup)


def _samples(
    parent: str, child: str, stamps_ns: IntArray, poses: FloatArray, *, static: bool
) -> Samples:
    quaternions = rotations.quaternion_from_matrix(poses[:, :3, :3])
    numbers = np.concatenate([poses[:, :3, 3], quaternions], axis=1)
    return Samples(parent, child, static, stamps_ns, stamps_ns + _POSE_DELAY_NS, numbers)


def _mixed(errors: FloatArray, places: FloatArray) -> FloatArray:
    """Return the (m, 6) errors at (m,) places between stations with (N, 6) errors."""
    stations = np.arange(len(errors))
    return np.stack([np.interp(places, stations, column) for column in errors.T], axis=1)
