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
from handeye_cli.geometry import error_radius, se3
from handeye_cli.geometry.loop import loop_jacobians
from handeye_cli.geometry.scaled_inverse import scaled_inverse
from handeye_cli.planning.uncertain_sight import UncertainSight
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
class UncertainRig:
    """Robot, camera and noise, as far as they are known, in D equally likely versions.

    Attributes:
        setup: Where the camera is fixed.
        X: (D, 4, 4) mount_T_camera.
        Z: (D, 4, 4) reference_T_target.
        robot_covariance: (6, 6) of the perturbation of base_T_gripper at every station.
        camera_covariance: (6, 6) of that of camera_T_target, or what the camera sees, from which
            it follows at each station; through uncertain intrinsics with m errors of their own.
    """

    setup: Setup
    X: FloatArray
    Z: FloatArray
    robot_covariance: FloatArray
    camera_covariance: FloatArray | Sight | UncertainSight

    def robot_chain(self, cameras: FloatArray) -> FloatArray:
        """Return the (D, K, 4, 4) reference_T_mount of (K, 4, 4) poses target_T_camera."""
        return np.asarray(self.Z[:, None] @ cameras @ se3.inverse(self.X)[:, None])

    def covariances(self, cameras: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the (D, K, 6, 6) covariance of the mount's and the (K, 6, 6) of the camera's pose.

        Args:
            cameras: (K, 4, 4) target_T_camera.
        """
        A = self.robot_chain(cameras)
        robot = self._of_mount(A)
        if isinstance(self.camera_covariance, Sight | UncertainSight):
            return robot, self.camera_covariance.covariance(se3.inverse(cameras))
        return robot, np.broadcast_to(self.camera_covariance, (len(cameras), 6, 6))

    def _of_mount(self, A: FloatArray) -> FloatArray:
        robot = np.broadcast_to(self.robot_covariance, (*A.shape[:2], 6, 6))
        if self.setup is Setup.EYE_IN_HAND:
            return robot
        by_robot = se3.inverse_jacobian(se3.inverse(A))
        return np.asarray(by_robot @ robot @ np.swapaxes(by_robot, -1, -2))

    def rows(self, cameras: FloatArray) -> FloatArray:
        """Return whitened derivatives W of the loops; a station tells `W' W`.

        Args:
            cameras: (K, 4, 4) target_T_camera.

        Returns:
            (D, K, 6 + m, 12 + m) by X, Z and the m errors of the intrinsics; the last m rows are
            what the pixels say of these beyond the station's pose.
        """
        A, B = self.robot_chain(cameras), se3.inverse(cameras)
        at = Solution(self.X, self.Z)
        if isinstance(self.camera_covariance, UncertainSight):
            view = self.camera_covariance.view(B)
            return whitened(
                A,
                np.broadcast_to(B, A.shape),
                at,
                robot=self._of_mount(A),
                camera=view.covariance,
                by_intrinsics=view.by_shared,
                of_intrinsics=view.information,
            )
        robot, camera = self.covariances(cameras)
        return whitened(A, np.broadcast_to(B, A.shape), at, robot=robot, camera=camera)


def directions() -> FloatArray:
    """Return (12, 3) unit vectors, an icosahedron's corners, whose mean stands for the sphere's."""
    golden = (1.0 + np.sqrt(5.0)) / 2.0
    corners = np.array([[0.0, a, b * golden] for a in (1.0, -1.0) for b in (1.0, -1.0)])
    turned = np.concatenate([np.roll(corners, k, axis=1) for k in range(3)])
    return np.asarray(turned / np.hypot(1.0, golden))


def whitened(
    A: FloatArray,
    B: FloatArray,
    at: Solution,
    *,
    robot: FloatArray,
    camera: FloatArray,
    by_intrinsics: FloatArray | None = None,
    of_intrinsics: FloatArray | None = None,
) -> FloatArray:
    """Return the derivatives of stations' loops by all unknowns in units of their residuals' noise.

    Args:
        A: (..., N, 4, 4) reference_T_mount.
        B: (..., N, 4, 4) camera_T_target.
        at: Where to linearise; its leading axes are those of A and B without the stations.
        robot: (..., N, 6, 6) covariances of the A's perturbations.
        camera: (..., N, 6, 6) covariances of the B's perturbations.
        by_intrinsics: (N, 6, m) how the B move with m errors of uncertain intrinsics.
        of_intrinsics: (N, m, m) information of the views on these, their poses eliminated.

    Returns:
        (..., N, 6, 12); with uncertain intrinsics (..., N, 6 + m, 12 + m).
    """
    loop = loop_jacobians(A, B, at.X, at.Z)
    by_robot, by_camera = loop.by_robot, loop.by_camera
    noise = by_robot @ robot @ np.swapaxes(by_robot, -1, -2)
    noise = noise + by_camera @ camera @ np.swapaxes(by_camera, -1, -2)
    design = loop.by_unknowns
    if by_intrinsics is not None:
        design = np.concatenate([design, by_camera @ by_intrinsics], axis=-1)
    rows = np.asarray(np.linalg.solve(np.linalg.cholesky(noise), design))
    return rows if of_intrinsics is None else _with_roots(rows, of_intrinsics)


def _with_roots(rows: FloatArray, of_intrinsics: FloatArray) -> FloatArray:
    """Return rows with m more, a root of the (N, m, m) information on the last m unknowns."""
    values, vectors = np.linalg.eigh(of_intrinsics)
    root = np.sqrt(np.maximum(values, 0.0))[..., None] * np.swapaxes(vectors, -1, -2)
    root = np.pad(root, ((0, 0), (0, 0), (12, 0)))
    more = np.broadcast_to(root, (*rows.shape[:-2], *root.shape[-2:]))
    return np.concatenate([rows, more], axis=-2)


def information(rows: FloatArray) -> FloatArray:
    """Return the (..., p, p) information of all (..., N, r, p) rows together."""
    stacked = rows.reshape(*rows.shape[:-3], -1, rows.shape[-1])
    return np.asarray(np.swapaxes(stacked, -1, -2) @ stacked)


def covariance(gathered: FloatArray, pull: FloatArray | None = None) -> FloatArray:
    """Return the (..., p, p) covariance of X, Z and what else is unknown.

    It is finite even before there is enough.

    An answer that is not told of errors which poses share, U, is moved by them like by any other:
    by `P g`, P being the covariance without them and g their pull `sum J_i' S_i^-1 U_i`.

    Args:
        gathered: (..., p, p) information.
        pull: (p, q) g of q shared errors of unit variance; none when not given.
    """
    alone = scaled_inverse(gathered + _UNKNOWN * np.eye(gathered.shape[-1]))
    if pull is None:
        return alone
    moved = alone @ pull
    return np.asarray(alone + moved @ np.swapaxes(moved, -1, -2))


def mean_squares(gathered: FloatArray, pull: FloatArray | None = None) -> FloatArray:
    """Return the (2,) expected squares of the answer's rotation and translation error.

    Args:
        gathered: (D, p, p) information; the squares are averaged over D.
        pull: (p, q) of shared errors; see `covariance`.
    """
    variances = np.einsum("dii->di", covariance(gathered, pull)).mean(axis=0)
    return se3.by_kind(variances[:6])[::-1]


def predicted_error(rig: UncertainRig, cameras: FloatArray, pairs: IntArray) -> PredictedError:
    """Return the error to expect of a calibration on planned stations.

    Args:
        rig: Robot, camera and noise.
        cameras: (N, 4, 4) target_T_camera, at least 3.
        pairs: (m, 2) interstation pairs, for the paper's own formulas.
    """
    gathered = information(rig.rows(cameras))
    return error_of(gathered, papers_error(rig, cameras, pairs))


def error_of(
    gathered: FloatArray,
    paper: PaperPrediction | None = None,
    pull: FloatArray | None = None,
    lasting: FloatArray | None = None,
) -> PredictedError:
    """Return RMS and 95 % radius of the answer's error.

    Args:
        gathered: (D, p, p) information.
        paper: What the paper's formulas predict, to stand beside it.
        pull: (p, q) of shared errors; see `covariance`.
        lasting: (6, 6) mean squares of X that are no matter of the information.
    """
    mean = covariance(gathered, pull)[:, :6, :6].mean(axis=0)
    mean = mean if lasting is None else mean + lasting
    wide = [error_radius.radius(mean[part, part], _PROBABILITY) for part in (slice(3, 6), slice(3))]
    rotation, translation = np.sqrt(se3.by_kind(np.diag(mean))[::-1]).tolist()
    return PredictedError(rotation, translation, wide[0], wide[1], paper)


def papers_error(rig: UncertainRig, cameras: FloatArray, pairs: IntArray) -> PaperPrediction | None:
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
