"""The time between a camera's images and a robot's poses, from what both tell of one motion.

Sign: an image of time t shows what the robot did at `t + offset`. The offset is what has to be
added to the images' times; it is negative where images are stamped too late.

The angle by which the camera turned between two images is that by which the robot turned between
their two times, wherever the camera sits: that gives a first offset without any other unknown. Then
the loop `A(t_i + offset) X B_i = Z` is closed by X, Z and the offset together. The offset moves a
station's residual by the robot's velocity, so its derivative is known, and its variance is one of
the thirteen on the diagonal of the inverse information.

Residuals have the covariance of the camera's pose, and three unknown variances: of the robot's
rotation, of its translation, and of the time of a single image, which counts in proportion to the
speed. A shutter that is open for long or reads row by row is not modelled: the first shifts the
offset to the middle of the exposure, the second that of the target's rows, and what is left adds to
the time noise of the images.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations, se3, statistics, variance
from handeye_cli.geometry.block_loop import damped_inverse, sufficient_variances
from handeye_cli.geometry.loop import isotropic_covariance, loop_jacobians
from handeye_cli.geometry.loop_start import close_loops
from handeye_cli.geometry.motion_invariants import pair_angles
from handeye_cli.geometry.trajectory import Trajectory

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_STEP = 5e-3
"""Seconds between the offsets that are tried first."""
_STRIDES = (1, 2, 4, 8)
"""How far apart in the list the images of a pair are."""
_TRUSTED = 2.0 / 3.0
"""Part of the pairs, the best ones, that a first offset has to explain."""
_ALIKE = 5.0
"""Angles of a view that differ by more than this multiple of what is usual are of a wrong pose."""
_FINEST = 1e-3
"""Difference of angles, in radians, that is never that of a wrong pose."""
_MAX_STEPS = 100
_LONGEST_STEP = 0.05
"""Seconds by which one step may change the offset."""
_SETTLED = 1e-3
"""Largest step, in standard deviations, at which the iteration has settled."""
_ROUNDS = 8
"""Times that images are sorted into those that fit and those that do not."""
_TYPICAL = 5.348
"""Median of a chi-square of six degrees of freedom."""
_FAR = 60.0
"""Chi-square of six degrees of freedom that only a wrong pose has (chance 5e-11)."""
_FLOOR = np.array([1e-7, 1e-7, 1e-6]) ** 2
"""Smallest variances considered: rad^2, m^2 and s^2."""
FEWEST_VIEWS = 5
"""Views that have equations enough for twice the thirteen unknowns."""
_NOTHING = 1e-6


@dataclass(frozen=True)
class MovingViews:
    """Target poses seen along the way of a robot.

    Attributes:
        path: base_T_gripper by the robot's clock.
        inverted: Whether the camera is fixed to the base: then reference_T_mount is gripper_T_base.
        times: (n,) times of the images in seconds, by their own clock.
        B: (n, 4, 4) camera_T_target.
        covariance: (n, 6, 6) of the perturbations of B.
    """

    path: Trajectory
    inverted: bool
    times: FloatArray
    B: FloatArray
    covariance: FloatArray

    def part(self, rows: BoolArray) -> MovingViews:
        """Return some of the views."""
        return replace(
            self, times=self.times[rows], B=self.B[rows], covariance=self.covariance[rows]
        )

    def robot(self, offset: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return where the robot was, and how that moves.

        Args:
            offset: Seconds added to the images' times.

        Returns:
            (n, 4, 4) reference_T_mount, (n, 6, 6) the derivative of its perturbation by that of
            base_T_gripper, and (n, 6) by the offset, per second.
        """
        times = self.times + offset
        poses, velocities = self.path.at(times), self.path.velocities(times)
        if not self.inverted:
            return poses, np.tile(np.eye(6), (len(poses), 1, 1)), velocities
        turned = se3.inverse_jacobian(poses)
        return se3.inverse(poses), turned, (turned @ velocities[..., None])[..., 0]


@dataclass(frozen=True)
class OffsetFit:
    """The offset with the answer it was found with.

    Attributes:
        offset: Seconds to add to the images' times.
        used: (n,) which views took part; the others are of wrong poses, or outside the path.
        X: (4, 4) mount_T_camera.
        Z: (4, 4) reference_T_target.
        covariance: (13, 13) of the perturbations of X and Z and of the offset.
        variances: (3,) of the robot's rotation and translation, as squares of RMS magnitudes, and
            of the time of a single image; rad^2, m^2 and s^2.
        feigned: Part of the information on the offset that the scatter of the robot's samples,
            which is in its velocity too, brings by itself.
        converged: Whether the iteration settled.
    """

    offset: float
    used: BoolArray
    X: FloatArray
    Z: FloatArray
    covariance: FloatArray
    variances: FloatArray
    feigned: float
    converged: bool

    @property
    def sigma(self) -> float:
        """Standard deviation of the offset, seconds; large where the motion does not tell it.

        Feigned information is known by its size only, and counts twice for safety.
        """
        return math.sqrt(self.covariance[-1, -1] / max(1.0 - 2.0 * self.feigned, _NOTHING))

    @property
    def jitter(self) -> float:
        """Standard deviation of the time of a single image, seconds."""
        return math.sqrt(self.variances[2])


def rough_offset(views: MovingViews, reach: float) -> float:
    """Return the offset at which camera and robot turn by the same angles, to a few milliseconds.

    Pairs of images that do not fit at all, such as those with a wrong pose, do not count.

    Args:
        views: At least two of them, in the order of their times.
        reach: Largest offset that is tried, seconds.

    Returns:
        The best offset of a grid; 0 where the path covers the images at none.
    """
    strides = [stride for stride in _STRIDES if stride < len(views.times)]
    index = np.arange(len(views.times))
    first = np.concatenate([index[:-stride] for stride in strides])
    second = np.concatenate([index[stride:] for stride in strides])
    offsets = _STEP * np.arange(-round(reach / _STEP), round(reach / _STEP) + 1)
    times = views.times + offsets[:, None]
    robot, known = views.path.at(times)[..., :3, :3], views.path.covers(times)
    turned = _angles(robot, first, second)
    seen = _angles(np.swapaxes(views.B[:, :3, :3], -1, -2), first, second)
    squares = np.where(known[:, first] & known[:, second], (turned - seen) ** 2, np.inf)
    trusted = max(int(_TRUSTED * len(first)), 1)
    costs = np.sum(np.partition(squares, trusted - 1, axis=1)[:, :trusted], axis=1)
    return float(offsets[np.argmin(costs)]) if np.isfinite(costs).any() else 0.0


def _angles(R: FloatArray, first: NDArray[np.int64], second: NDArray[np.int64]) -> FloatArray:
    return rotations.angle(np.swapaxes(R[..., first, :, :], -1, -2) @ R[..., second, :, :])


def angles_apart(views: MovingViews, offset: float) -> FloatArray:
    """Return how far robot and camera differ in the angles they turn by, at an offset.

    A view is compared with all others that the path covers, and the median of them is taken: a
    wrong pose has another angle to nearly all, a right one to those with wrong poses.

    Args:
        views: Of n images.
        offset: Seconds added to their times.

    Returns:
        (n,) angles in radians; infinite where the path does not cover the view and another.
    """
    rows = np.flatnonzero(views.path.covers(views.times + offset))
    apart = np.full(len(views.times), np.inf)
    if len(rows) < 2:
        return apart
    robot = views.path.at(views.times[rows] + offset)[:, :3, :3]
    seen = np.swapaxes(views.B[rows, :3, :3], -1, -2)
    differences = np.abs(pair_angles(robot) - pair_angles(seen))
    # the least of each row is that of a view with itself
    apart[rows] = np.median(np.sort(differences, axis=1)[:, 1:], axis=1)
    return apart


def _alike(views: MovingViews, offset: float) -> BoolArray:
    """Return (n,) which covered views turn as most of them do."""
    apart = angles_apart(views, offset)
    covered = np.isfinite(apart)
    usual = statistics.median(apart[covered]) if covered.any() else 0.0
    return np.asarray(covered & (apart <= _ALIKE * usual + _FINEST))


def estimate(views: MovingViews, start: float) -> OffsetFit | None:
    """Close the loops of all views by X, Z and the offset together, at the best weights.

    Views whose pose is wrong do not count, as long as most are right.

    Args:
        views: Of n images in motion.
        start: A first offset, within some tens of milliseconds, seconds.

    Returns:
        The maximum-likelihood estimate, or None where fewer than `FEWEST_VIEWS` are left.
    """
    used = _alike(views, start)
    found = None
    for _ in range(_ROUNDS):
        if np.count_nonzero(used) < FEWEST_VIEWS:
            return None
        found = _fitted(views, used, start if found is None else found.offset)
        fitting = _fitting(views, found)
        if not found.converged or np.array_equal(fitting, used):
            break
        used = fitting
    return found


@dataclass(frozen=True)
class _Linear:
    """Loops of n views, linearised.

    Residuals (n, 6), design (n, 6, 13), derivative by base_T_gripper (n, 6, 6), known covariance
    (n, 6, 6), and what each unknown variance adds to it (3, n, 6, 6).
    """

    residuals: FloatArray
    design: FloatArray
    by_robot: FloatArray
    known: FloatArray
    shapes: FloatArray

    def covariance(self, variances: FloatArray) -> FloatArray:
        return np.asarray(self.known + np.tensordot(variances, self.shapes, axes=1))


def _linear(views: MovingViews, X: FloatArray, Z: FloatArray, offset: float) -> _Linear:
    A, by_pose, by_offset = views.robot(offset)
    loop = loop_jacobians(A, views.B, X, Z)
    by_robot = loop.by_robot @ by_pose
    late = loop.by_robot @ by_offset[..., None]
    units = isotropic_covariance(1.0, 0.0), isotropic_covariance(0.0, 1.0)
    shapes = [by_robot @ unit @ np.swapaxes(by_robot, -1, -2) for unit in units]
    return _Linear(
        residuals=loop.residuals,
        design=np.concatenate([loop.by_unknowns, late], axis=-1),
        by_robot=by_robot,
        known=loop.by_camera @ views.covariance @ np.swapaxes(loop.by_camera, -1, -2),
        shapes=np.stack([*shapes, late @ np.swapaxes(late, -1, -2)]),
    )


def _fitted(views: MovingViews, used: BoolArray, offset: float) -> OffsetFit:
    """Return the estimate from the used views by Gauss-Newton steps, weights and answer in turns.

    The weights of a step are those of the residuals before it.
    """
    part = views.part(used)
    X, Z = close_loops(part.robot(offset)[0], part.B)
    linear = _linear(part, X, Z, offset)
    variances = sufficient_variances(linear.residuals, linear.shapes) / len(linear.shapes)
    for _ in range(_MAX_STEPS):
        variances = _variances(linear, variances)
        step, information = _step(linear, variances)
        X, Z = se3.perturb(X, step[:6]), se3.perturb(Z, step[6:12])
        offset += float(step[12])
        linear = _linear(part, X, Z, offset)
        converged = bool(step @ information @ step < _SETTLED**2)
        if converged:
            break
    covariance = damped_inverse(information)
    noise = _feigned_information(part, linear, variances)
    feigned = noise * float(covariance[-1, -1])
    return OffsetFit(offset, used, X, Z, covariance, variances, feigned, converged)


def _feigned_information(views: MovingViews, linear: _Linear, variances: FloatArray) -> float:
    """Return the information on the offset that velocities of nothing but noise would have."""
    spread = np.diag(views.path.velocity_noise() ** 2)
    late = linear.by_robot @ spread @ np.swapaxes(linear.by_robot, -1, -2)
    return float(np.einsum("nii->", np.linalg.solve(linear.covariance(variances), late)))


def _variances(linear: _Linear, start: FloatArray) -> FloatArray:
    return variance.estimate(
        residuals=linear.residuals,
        design=linear.design,
        known=linear.known,
        shapes=linear.shapes,
        start=start,
        floor=_FLOOR,
    ).variances


def _step(linear: _Linear, variances: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the (13,) step of X, Z and the offset, and the (13, 13) information on them."""
    J = linear.design
    weighted = np.linalg.solve(linear.covariance(variances), J)
    information = np.einsum("nij,nik->jk", J, weighted)
    step = -damped_inverse(information) @ np.einsum("nij,ni->j", weighted, linear.residuals)
    return step * min(1.0, _LONGEST_STEP / max(abs(step[12]), _LONGEST_STEP)), information


def _fitting(views: MovingViews, found: OffsetFit) -> BoolArray:
    """Return (n,) which views the estimate explains, by the scale of most of them."""
    linear = _linear(views, found.X, found.Z, found.offset)
    S = linear.covariance(found.variances)
    white = np.linalg.solve(S, linear.residuals[..., None])[..., 0]
    squares = np.sum(linear.residuals * white, axis=-1)
    covered = views.path.covers(views.times + found.offset)
    if not covered.any():
        return covered
    scale = max(statistics.median(squares[covered]) / _TYPICAL, 1.0)
    return np.asarray(covered & (squares <= _FAR * scale))
