"""What planned stations are worth: the covariance of the answer they would lead to.

The maximum-likelihood answer has the covariance `(sum J_i' S_i^-1 J_i)^-1`, J_i being the
derivative of a station's loop by X and Z and S_i the covariance of its residual. Where the camera's
place on the mount is not known, only the vector between gripper and camera (or target) matters, and
the mean squares are averaged over its directions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handeye_cli.chain import Chain
from handeye_cli.conventions import Setup
from handeye_cli.geometry import se3, statistics
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.predict import paper_prediction
from handeye_cli.records import FloatArray, IntArray, PaperPrediction, PredictedError
from handeye_cli.sight import Sight
from handeye_cli.solvers import Solution

PAPERS_LEVER = 9.5 * 0.0254
"""|T_cg| of the paper's experiments, metres."""
_PROBABILITY = 0.95
_UNKNOWN = 1e-6
"""Information on every unknown before there is any station: that of a kilometre, a thousand rad."""


@dataclass(frozen=True)
class Rig:
    """Robot, camera and noise, as far as they are known, in D equally likely versions.

    Attributes:
        setup: Where the camera is fixed.
        X: (D, 4, 4) mount_T_camera.
        Z: (D, 4, 4) reference_T_target.
        robot_covariance: (6, 6) of the perturbation of base_T_gripper at every station.
        camera_covariance: (6, 6) of that of camera_T_target, or what the camera sees, from which
            it follows at each station.
    """

    setup: Setup
    X: FloatArray
    Z: FloatArray
    robot_covariance: FloatArray
    camera_covariance: FloatArray | Sight

    def robot_chain(self, cameras: FloatArray) -> FloatArray:
        """Return the (D, K, 4, 4) reference_T_mount of (K, 4, 4) poses target_T_camera."""
        return np.asarray(self.Z[:, None] @ cameras @ se3.inverse(self.X)[:, None])

    def covariances(self, cameras: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the (D, K, 6, 6) covariance of the mount's and the (K, 6, 6) of the camera's pose.

        Args:
            cameras: (K, 4, 4) target_T_camera.
        """
        A = self.robot_chain(cameras)
        robot = np.broadcast_to(self.robot_covariance, (*A.shape[:2], 6, 6))
        if self.setup is Setup.EYE_TO_HAND:
            by_robot = se3.inverse_jacobian(se3.inverse(A))
            robot = by_robot @ robot @ np.swapaxes(by_robot, -1, -2)
        if isinstance(self.camera_covariance, Sight):
            return robot, self.camera_covariance.covariance(se3.inverse(cameras))
        return robot, np.broadcast_to(self.camera_covariance, (len(cameras), 6, 6))

    def rows(self, cameras: FloatArray) -> FloatArray:
        """Return (D, K, 6, 12) whitened derivatives W of the loops; a station tells `W' W`.

        Args:
            cameras: (K, 4, 4) target_T_camera.
        """
        robot, camera = self.covariances(cameras)
        A, B = self.robot_chain(cameras), se3.inverse(cameras)
        at = Solution(self.X, self.Z)
        return whitened(A, np.broadcast_to(B, A.shape), at, robot=robot, camera=camera)


def directions() -> FloatArray:
    """Return (12, 3) unit vectors, an icosahedron's corners, whose mean stands for the sphere's."""
    golden = (1.0 + np.sqrt(5.0)) / 2.0
    corners = np.array([[0.0, a, b * golden] for a in (1.0, -1.0) for b in (1.0, -1.0)])
    turned = np.concatenate([np.roll(corners, k, axis=1) for k in range(3)])
    return np.asarray(turned / np.hypot(1.0, golden))


def whitened(
    A: FloatArray, B: FloatArray, at: Solution, *, robot: FloatArray, camera: FloatArray
) -> FloatArray:
    """Return the derivatives of stations' loops by X and Z in units of their residuals' noise.

    Args:
        A: (..., N, 4, 4) reference_T_mount.
        B: (..., N, 4, 4) camera_T_target.
        at: Where to linearise; its leading axes are those of A and B without the stations.
        robot: (..., N, 6, 6) covariances of the A's perturbations.
        camera: (..., N, 6, 6) covariances of the B's perturbations.

    Returns:
        (..., N, 6, 12).
    """
    loop = loop_jacobians(A, B, at.X, at.Z)
    by_robot, by_camera = loop.by_robot, loop.by_camera
    noise = by_robot @ robot @ np.swapaxes(by_robot, -1, -2)
    noise = noise + by_camera @ camera @ np.swapaxes(by_camera, -1, -2)
    return np.asarray(np.linalg.solve(np.linalg.cholesky(noise), loop.by_unknowns))


def information(rows: FloatArray) -> FloatArray:
    """Return the (..., 12, 12) information of all (..., N, 6, 12) rows together."""
    stacked = rows.reshape(*rows.shape[:-3], -1, rows.shape[-1])
    return np.asarray(np.swapaxes(stacked, -1, -2) @ stacked)


def covariance(gathered: FloatArray) -> FloatArray:
    """Return the (..., 12, 12) covariance of X and Z, finite even before there is enough.

    Args:
        gathered: (..., 12, 12) information.
    """
    total = gathered + _UNKNOWN * np.eye(gathered.shape[-1])
    scale = 1.0 / np.sqrt(np.einsum("...ii->...i", total))
    inverse = np.linalg.inv(scale[..., :, None] * total * scale[..., None, :])
    return np.asarray(scale[..., :, None] * inverse * scale[..., None, :])


def mean_squares(gathered: FloatArray) -> FloatArray:
    """Return the (2,) expected squares of the answer's rotation and translation error.

    Args:
        gathered: (D, 12, 12) information; the squares are averaged over D.
    """
    variances = np.einsum("dii->di", covariance(gathered))[:, :6].mean(axis=0)
    return np.array([variances[3:].sum(), variances[:3].sum()])


def predicted_error(rig: Rig, cameras: FloatArray, pairs: IntArray) -> PredictedError:
    """Return the error to expect of a calibration on planned stations.

    Args:
        rig: Robot, camera and noise.
        cameras: (N, 4, 4) target_T_camera, at least 3.
        pairs: (m, 2) interstation pairs, for the paper's own formulas.
    """
    gathered = information(rig.rows(cameras))
    return error_of(gathered, papers_error(rig, cameras, pairs))


def error_of(gathered: FloatArray, paper: PaperPrediction | None = None) -> PredictedError:
    """Return RMS and 95 % radius of the answer's error for (D, 12, 12) information."""
    mean = covariance(gathered)[:, :6, :6].mean(axis=0)
    wide = [statistics.radius(mean[part, part], _PROBABILITY) for part in (slice(3, 6), slice(3))]
    rotation, translation = np.sqrt(mean_squares(gathered)).tolist()
    return PredictedError(rotation, translation, wide[0], wide[1], paper)


def papers_error(rig: Rig, cameras: FloatArray, pairs: IntArray) -> PaperPrediction | None:
    """Return what eq. (29)-(33) predict, as RMS over the rig's versions, or None if they cannot.

    Args:
        rig: Robot, camera and noise.
        cameras: (N, 4, 4) target_T_camera.
        pairs: (m, 2) interstation pairs.
    """
    robot, camera = rig.covariances(cameras)
    joint = np.zeros((*robot.shape[:2], 12, 12))
    joint[..., :6, :6], joint[..., 6:, 6:] = robot, camera
    B = se3.inverse(cameras)
    found = [
        paper_prediction(_chain(A, B), pairs, noise)
        for A, noise in zip(rig.robot_chain(cameras), joint, strict=True)
    ]
    known = [
        (each.rotation, each.translation, each.rotation_max, each.translation_max)
        for each in found
        if each is not None
    ]
    return PaperPrediction(*np.sqrt(np.mean(np.square(known), axis=0)).tolist()) if known else None


def _chain(A: FloatArray, B: FloatArray) -> Chain:
    count = len(A)
    return Chain(
        index=np.arange(count),
        A=A,
        B=B,
        by_robot=np.broadcast_to(np.eye(6), (count, 6, 6)),
        camera_covariance=np.zeros((count, 6, 6)),
        has_covariance=False,
        by_intrinsics=np.zeros((count, 6, 0)),
    )
