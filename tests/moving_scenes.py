"""A robot that never pauses, seen by its camera at known times: the truth of time offsets."""

from dataclasses import dataclass

import numpy as np

from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.station_generator import generate_stations, robot_poses
from handeye_cli.geometry.time_offset import MovingViews
from handeye_cli.geometry.trajectory import Trajectory
from handeye_cli.simulate.motion import SECOND_NS, along, timetable

X = se3.from_parts(rotations.exp(np.array([0.35, -0.25, 1.4])), np.array([0.11, -0.12, 0.178]))
Z = se3.from_parts(rotations.exp(np.array([3.0, 0.2, 0.1])), np.array([0.5, 0.1, 0.0]))
ROBOT = np.repeat([5e-5, 2e-4], 3) / np.sqrt(3)
CAMERA = np.repeat([2.5e-5, 1e-4], 3) / np.sqrt(3)
"""Standard deviations of each axis, m and rad, of every sample and of every view."""


@dataclass
class Run:
    """A way through random places around a target.

    Attributes:
        rng: Source of all chance.
        setup: Where the camera is.
        offset: Seconds that the images' times lack.
        views: How many images.
        jitter: Scatter of the images' times, seconds.
        noise: Factor on the noise of the poses.
        stops: Places between which it goes.
    """

    rng: np.random.Generator
    setup: Setup = Setup.EYE_IN_HAND
    offset: float = 0.038
    views: int = 40
    jitter: float = 0.0
    noise: float = 1.0
    stops: int = 8

    def __post_init__(self):
        cameras = generate_stations(self.stops, 0.25, 0.5)
        spread = self.rng.normal(0.0, np.repeat([0.01, 0.15], 3), (self.stops, 6))
        self.cameras = se3.perturb(cameras, spread)
        self.table = timetable(self._robot, self.stops, pause_ns=SECOND_NS // 100)
        self.seconds = self.table.departures_ns[-1] / SECOND_NS

    def _robot(self, places):
        return robot_poses(along(self.cameras, places), X, Z, self.setup)

    def places(self, seconds):
        return self.table.places(np.rint(np.asarray(seconds) * SECOND_NS).astype(np.int64))

    def path(self, rate=100.0):
        times = np.arange(0.0, self.seconds, 1.0 / rate)
        scatter = self.noise * self.rng.normal(0.0, ROBOT, (len(times), 6))
        return Trajectory(times, se3.perturb(self._robot(self.places(times)), scatter))

    def seen(self, seconds):
        """Exact poses camera_T_target."""
        return se3.inverse(along(self.cameras, self.places(seconds)))

    def moving_views(self):
        path = self.path()
        taken = np.sort(self.rng.uniform(0.1, self.seconds - 0.1, self.views))
        scatter = self.noise * self.rng.normal(0.0, CAMERA, (self.views, 6))
        return MovingViews(
            path=path,
            inverted=self.setup is Setup.EYE_TO_HAND,
            times=taken - self.offset + self.jitter * self.rng.standard_normal(self.views),
            B=se3.perturb(self.seen(taken), scatter),
            covariance=np.tile(np.diag((self.noise * CAMERA) ** 2), (self.views, 1, 1)),
        )
