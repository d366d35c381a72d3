"""The predicted error of stations that lie elsewhere, or whose poses are known better.

The answer X and the constant Z stay. A change moves the camera against the target, B, and the robot
follows so that the loop stays closed: `A = Z B^-1 X^-1`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli import solvers
from handeye_cli.conventions import Setup
from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.station_generator import generate_stations
from handeye_cli.records import FloatArray, IntArray
from handeye_cli.sight import Sight
from handeye_cli.solvers import Problem, Solution

MAX_ADVISED_TILT = np.radians(55.0)
"""Between line of sight and plate normal; beyond it a plate is too foreshortened to measure."""
_NEARER = np.linspace(1.0, 0.5, 11)
_TILTED = np.linspace(1.0, 1.5, 6)


@dataclass(frozen=True)
class Layout:
    """Stations as the camera has them.

    Attributes:
        B: (N, 4, 4) camera_T_target.
        camera_covariance: (N, 6, 6) of their perturbations.
        pairs: (m, 2) interstation pairs, for the methods that use them.
    """

    B: FloatArray
    camera_covariance: FloatArray
    pairs: IntArray


@dataclass(frozen=True)
class Givens:
    """What a what-if leaves as it is.

    Attributes:
        setup: Where the camera is fixed.
        method: A row of the table of solvers.
        solution: The answer.
        robot_covariance: (6, 6) of the perturbation of base_T_gripper at every station.
    """

    setup: Setup
    method: str
    solution: Solution
    robot_covariance: FloatArray

    def mean_squares(self, layout: Layout) -> FloatArray:
        """Return the (2, 2) expected squares of the answer's error, to first order.

        Rows are what is due to the robot and to the camera, columns rotation (radians^2) and
        translation (metres^2).
        """
        X, Z = self.solution.X, self.solution.Z
        A = Z @ se3.inverse(X @ layout.B)
        covariance = np.zeros((len(A), 12, 12))
        covariance[:, :6, :6] = self._of_mount(A)
        covariance[:, 6:, 6:] = layout.camera_covariance
        problem = Problem(A, layout.B, layout.pairs, covariance)
        influence = solvers.load(self.method).influence(problem, self.solution)[:, :6]
        parts = np.sum((influence @ covariance) * influence, axis=0)
        return np.asarray(parts.reshape(2, 3, 2, 6).sum(axis=(1, 3))[::-1].T)

    def _of_mount(self, A: FloatArray) -> FloatArray:
        if self.setup is Setup.EYE_IN_HAND:
            return np.broadcast_to(self.robot_covariance, (len(A), 6, 6))
        by_robot = se3.inverse_jacobian(se3.inverse(A))
        return np.asarray(by_robot @ self.robot_covariance @ np.swapaxes(by_robot, -1, -2))


def distances(B: FloatArray, centre: FloatArray) -> FloatArray:
    """Return the (...) distances of cameras from a (3,) point of the target, metres."""
    return np.asarray(np.linalg.norm(se3.transform_points(B, centre[None])[..., 0, :], axis=-1))


def tilts(B: FloatArray, centre: FloatArray) -> FloatArray:
    """Return the (...) angles between plate normal and line of sight to a point of the target."""
    away = _viewpoints(B, centre)
    return np.asarray(np.arctan2(np.hypot(away[..., 0], away[..., 1]), np.abs(away[..., 2])))


def nearer(B: FloatArray, centre: FloatArray, sight: Sight | None) -> FloatArray:
    """Return stations at half their distance from a point of the target.

    Args:
        B: (N, 4, 4) camera_T_target.
        centre: (3,) point of the target that the cameras move towards.
        sight: What they see; a station only comes as near as this stays in view.
    """
    moved = np.broadcast_to(B, (len(_NEARER), *B.shape)).copy()
    towards = (1.0 - _NEARER)[:, None, None] * (B[:, :3, :3] @ centre + B[:, :3, 3])
    moved[..., :3, 3] -= towards
    return _farthest_change(moved, _fits(moved, sight))


def more_tilted(B: FloatArray, centre: FloatArray, sight: Sight | None) -> FloatArray:
    """Return stations that look at the target from up to 1.5 times as far aside.

    Each turns rigidly about the centre, as in the paper's station generator, away from the mean
    direction of view; it stops at 55 degrees against the plate's normal.

    Args:
        B: (N, 4, 4) camera_T_target.
        centre: (3,) point of the target that the stations turn about.
        sight: What they see; a station only turns as far as this stays in view.
    """
    view = _viewpoints(B, centre)
    mean = np.mean(view, axis=0)
    axis = np.cross(mean, view)
    sine = np.linalg.norm(axis, axis=-1, keepdims=True)
    swing = axis / np.maximum(sine, 1e-300) * np.arctan2(sine, view @ mean[:, None])
    turned = _turned(B, rotations.exp((_TILTED - 1.0)[:, None, None] * swing), centre)
    return _farthest_change(
        turned, _fits(turned, sight) & (tilts(turned, centre) <= MAX_ADVISED_TILT)
    )


def circle(
    B: FloatArray, centre: FloatArray, distance: float, tilt: float, sight: Sight | None
) -> FloatArray | None:
    """Return as many stations on the paper's circle, with the cameras' mean roll and side.

    Args:
        B: (N, 4, 4) camera_T_target.
        centre: (3,) point of the target that they look at.
        distance: From it, metres.
        tilt: Against the plate's normal, radians.
        sight: What they would see.

    Returns:
        (N, 4, 4) camera_T_target, or None where the target would leave the view.
    """
    front = np.mean(_viewpoints(B, centre)[:, 2]) <= 0.0
    side = np.diag([1.0, 1.0, 1.0] if front else [1.0, -1.0, -1.0])
    M = side @ rotations.mean(np.swapaxes(B[:, :3, :3], -1, -2))
    roll = np.arctan2(M[1, 0] - M[0, 1], M[0, 0] + M[1, 1])
    cameras = generate_stations(len(B), distance, tilt)
    cameras = cameras @ se3.from_parts(rotations.exp(np.array([0.0, 0.0, roll])), np.zeros(3))
    laid = se3.inverse(se3.from_parts(side, centre) @ cameras)
    return laid if np.all(_fits(laid, sight)) else None


def _viewpoints(B: FloatArray, centre: FloatArray) -> FloatArray:
    """Return (..., 3) unit vectors in the target frame from a point of it to the cameras."""
    away = -np.swapaxes(B[..., :3, :3], -1, -2) @ B[..., :3, 3:]
    away = away[..., 0] - centre
    return np.asarray(away / np.linalg.norm(away, axis=-1, keepdims=True))


def _turned(B: FloatArray, turn: FloatArray, centre: FloatArray) -> FloatArray:
    """Return cameras turned rigidly about a point of the target, by turns in the target frame."""
    R = B[:, :3, :3] @ np.swapaxes(turn, -1, -2)
    return se3.from_parts(R, B[:, :3, :3] @ centre + B[:, :3, 3] - R @ centre)


def _fits(B: FloatArray, sight: Sight | None) -> NDArray[np.bool_]:
    return np.ones(B.shape[:-2], dtype=bool) if sight is None else sight.in_view(B)


def _farthest_change(tried: FloatArray, possible: NDArray[np.bool_]) -> FloatArray:
    """Return for every station the last of (K, N) poses before the first that is not possible."""
    steps = np.cumprod(possible[1:], axis=0).sum(axis=0)
    return np.asarray(tried[steps, np.arange(tried.shape[1])])
