"""The usable stations of a document as arrays of the loop `A_i X B_i = Z`, for either setup."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handeye_cli.conventions import Setup
from handeye_cli.errors import UndeterminedError
from handeye_cli.geometry import se3
from handeye_cli.geometry.loop import LoopJacobians
from handeye_cli.records import FloatArray, IntArray, Noise, Stations

MIN_STATIONS = 3


@dataclass(frozen=True)
class Chain:
    """Poses of N stations.

    Attributes:
        index: (N,) position of each station in the document.
        A: (N, 4, 4) reference_T_mount.
        B: (N, 4, 4) camera_T_target.
        by_robot: (N, 6, 6) derivative of A's perturbation by that of base_T_gripper.
        camera_covariance: (N, 6, 6) of B's perturbation; zero where the document has none.
        has_covariance: Whether every station came with a covariance.
        by_intrinsics: (N, 6, m) how the B_i move with m independent errors of unit variance in the
            intrinsics that all of them rest on; m is 0 where the intrinsics are taken as exact.
        robot_covariance: (N, 6, 6) of the perturbation of base_T_gripper that is known beside the
            robot's noise, or None.
        shared_error: (N, 6) perturbation of base_T_gripper by one standard deviation of an error
            that all robot poses share, or None.
    """

    index: IntArray
    A: FloatArray
    B: FloatArray
    by_robot: FloatArray
    camera_covariance: FloatArray
    has_covariance: bool
    by_intrinsics: FloatArray
    robot_covariance: FloatArray | None = None
    shared_error: FloatArray | None = None

    def part(self, rows: slice | IntArray) -> Chain:
        """Return the chain of some of its stations."""
        return replace(
            self,
            index=self.index[rows],
            A=self.A[rows],
            B=self.B[rows],
            by_robot=self.by_robot[rows],
            camera_covariance=self.camera_covariance[rows],
            by_intrinsics=self.by_intrinsics[rows],
            robot_covariance=None if self.robot_covariance is None else self.robot_covariance[rows],
            shared_error=None if self.shared_error is None else self.shared_error[rows],
        )

    @property
    def by_shared_error(self) -> FloatArray:
        """(N, 6, k) how the A_i move with k independent errors of unit variance; k is 0 or 1."""
        if self.shared_error is None:
            return np.zeros((len(self.A), 6, 0))
        return np.asarray(self.by_robot @ self.shared_error[..., None])

    @property
    def by_causes(self) -> FloatArray:
        """(N, 12, q) how the A_i and B_i move with all q errors that the stations share.

        These are independent and of unit variance: first those of the intrinsics, which move the
        B_i, then that of the robot poses, which moves the A_i.
        """
        of_camera, of_robot = self.by_intrinsics, self.by_shared_error
        return np.concatenate(
            [
                np.pad(of_camera, ((0, 0), (6, 0), (0, 0))),
                np.pad(of_robot, ((0, 0), (0, 6), (0, 0))),
            ],
            axis=-1,
        )

    def by_shared_causes(self, loop: LoopJacobians) -> FloatArray:
        """Return (N, 6, q) how the loops' residuals move with the shared errors (`by_causes`).

        Args:
            loop: Of these stations.
        """
        return np.asarray(loop.by_poses @ self.by_causes)

    def caused(self, influence: FloatArray) -> FloatArray:
        """Return (p, q) how a result moves with the shared errors (`by_causes`).

        Args:
            influence: (N, p, 12) how it moves with each station's poses.
        """
        return np.asarray(np.einsum("nij,njk->ik", influence, self.by_causes))


def chain_of(stations: Stations, fewest: int = MIN_STATIONS) -> Chain:
    """Collect the stations with a target pose.

    Args:
        stations: The document.
        fewest: How many there have to be; three is the minimum of the paper's lemmas VII and IX.

    Raises:
        UndeterminedError: There are fewer.
    """
    usable = [
        (i, station.base_T_gripper, station.camera_T_target)
        for i, station in enumerate(stations.stations)
        if station.camera_T_target is not None
    ]
    if len(usable) < fewest:
        what = "station" if fewest == 1 else "stations"
        raise UndeterminedError(
            f"expected at least {fewest} {what} with a target pose, found {len(usable)} of "
            f"{len(stations.stations)}",
            hint="record more stations; 'handeye extract' lists why images were not used",
        )
    robot = np.array([pose for _, pose, _ in usable])
    covariances = [seen.covariance for _, _, seen in usable]
    used = [stations.stations[i] for i, _, _ in usable]
    eye_in_hand = stations.setup is Setup.EYE_IN_HAND
    return Chain(
        index=np.array([i for i, _, _ in usable]),
        A=robot if eye_in_hand else se3.inverse(robot),
        B=np.array([seen.matrix for _, _, seen in usable]),
        by_robot=np.tile(np.eye(6), (len(robot), 1, 1))
        if eye_in_hand
        else se3.inverse_jacobian(robot),
        camera_covariance=np.array([np.zeros((6, 6)) if C is None else C for C in covariances]),
        has_covariance=all(C is not None for C in covariances),
        by_intrinsics=np.zeros((len(robot), 6, 0)),
        robot_covariance=_together([each.robot_covariance for each in used], (6, 6)),
        shared_error=_together([each.shared_error for each in used], (6,)),
    )


def _together(known: list[FloatArray | None], shape: tuple[int, ...]) -> FloatArray | None:
    """Return what is known of N stations as one array, zero where it is not; None without any."""
    if all(each is None for each in known):
        return None
    return np.array([np.zeros(shape) if each is None else each for each in known])


def has_pixels(stations: Stations, chain: Chain) -> bool:
    """Return whether pixels stand behind the target poses of all stations of a chain.

    Given levels of the camera's noise stand above what the pixels say; then they do not.
    """
    noise = stations.noise or Noise()
    if stations.target is None or stations.camera is None:
        return False
    if noise.camera_rotation is not None or noise.camera_translation is not None:
        return False
    from handeye_cli.geometry import pnp

    seen = [stations.stations[index].observation for index in chain.index]
    return all(each is not None and len(each.ids) >= pnp.MIN_POINTS for each in seen)
