"""Pose of a planar target from its points' pixels, with both solutions of the planar ambiguity.

Batched over views: the target's points are common, a mask says which of them a view shows. Poses
are `camera_T_target`; residuals are pixels, so distortion is part of the model that is fitted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations, se3
from handeye_cli.geometry.camera import Lens, normalise, project, project_jacobians

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

MIN_POINTS = 4
"""Points a view needs: four fix the pose of a plane."""
_MAX_STEPS = 100
_HOPELESS = 1e12
"""Damping at which no step helps any more."""
_SAME_POSE = 1e-3
"""Two optima closer than this rotation in radians are one."""
_GAIN_TOLERANCE = 1e-13
"""Relative decrease of the squares below which a view has converged."""


@dataclass(frozen=True)
class Sightings:
    """What one or many views saw of a planar target.

    Attributes:
        points: (n, 3) target points in metres, all with z = 0; common to all views.
        pixels: (..., n, 2) their pixels; whatever stands where the mask is False is ignored.
        mask: (..., n) True where the point was seen; at least four, not on one line.
    """

    points: FloatArray
    pixels: FloatArray
    mask: BoolArray

    def part(self, rows: slice | IntArray | BoolArray) -> Sightings:
        """Return some of the views."""
        return replace(self, pixels=self.pixels[rows], mask=self.mask[rows])


@dataclass(frozen=True)
class PlanarPoses:
    """The two poses a planar target can have in each view.

    Attributes:
        poses: (..., 2, 4, 4) camera_T_target, the one with the smaller residual first.
        squares: (..., 2) sums of squared pixel residuals; infinite where a solution is missing.
        distinct: (...) whether the second is a pose of its own and not the first once more.
    """

    poses: FloatArray
    squares: FloatArray
    distinct: BoolArray


def planar_poses(seen: Sightings, lens: Lens) -> PlanarPoses:
    """Find both local optima of the pose of a planar target in every view.

    The first starts from the homography, the second from the first with the target mirrored in
    depth along the line of sight, which is where weak perspective leaves the second optimum.

    Args:
        seen: The views.
        lens: Intrinsics.

    Returns:
        Both poses of each view.
    """
    directions = normalise(np.where(seen.mask[..., None], seen.pixels, 0.0), *_parts(lens))
    mask = seen.mask & np.all(np.isfinite(directions), axis=-1)
    enough = np.sum(mask, axis=-1, keepdims=True) >= MIN_POINTS
    mask, directions = mask & enough, np.where(mask[..., None], directions, 0.0)
    seen = replace(seen, mask=mask)
    # Where the lens leaves too few points, any points serve: the view is given up below.
    shown = np.where(enough[..., None], directions, seen.points[:, :2])
    H = homography(seen.points[:, :2], shown, mask | ~enough)
    first = refine(pose_from_homography(H), seen, lens)
    second = refine(_mirrored(first[0], seen), seen, lens)
    best, worse = _ordered(first, second)
    # A start on the ridge between the optima may creep along it: mirror the better one once more.
    again = refine(_mirrored(best[0], seen), seen, lens)
    best, other = _ordered(best, again)
    other, _ = _ordered(*(_unless_same(pose, best) for pose in (other, worse)))
    squares = np.where(enough, np.stack([best[1], other[1]], axis=-1), np.inf)
    return PlanarPoses(
        np.stack([best[0], other[0]], axis=-3), squares, np.isfinite(squares[..., 1])
    )


_Fit = tuple[FloatArray, FloatArray]
"""Poses (..., 4, 4) and their sums of squares (...)."""


def _ordered(a: _Fit, b: _Fit) -> tuple[_Fit, _Fit]:
    swap = b[1] < a[1]
    over = swap[..., None, None]
    low = np.where(over, b[0], a[0]), np.where(swap, b[1], a[1])
    return low, (np.where(over, a[0], b[0]), np.where(swap, a[1], b[1]))


def _unless_same(fit: _Fit, best: _Fit) -> _Fit:
    turn = np.swapaxes(best[0][..., :3, :3], -1, -2) @ fit[0][..., :3, :3]
    return fit[0], np.where(rotations.angle(turn) > _SAME_POSE, fit[1], np.inf)


def _weights(mask: BoolArray) -> FloatArray:
    return np.asarray(mask / np.maximum(np.sum(mask, axis=-1, keepdims=True), 1))


def _parts(lens: Lens) -> tuple[FloatArray, str]:
    return lens.parameters, lens.model


def homography(plane: FloatArray, image: FloatArray, mask: BoolArray) -> FloatArray:
    """Return the (..., 3, 3) maps from plane to image by the normalised linear method.

    Args:
        plane: (n, 2) points in the target's plane.
        image: (..., n, 2) their images.
        mask: (..., n) True where a point was seen.

    Returns:
        Homographies of unit norm, signed so that the seen points lie in front.
    """
    weight = mask.astype(float)
    to_plane, p = _conditioned(np.broadcast_to(plane, image.shape), weight)
    to_image, q = _conditioned(image, weight)
    ones = np.ones((*p.shape[:-1], 1))
    P = np.concatenate([p, ones], axis=-1) * weight[..., None]
    zero = np.zeros_like(P)
    rows_x = np.concatenate([P, zero, -q[..., :1] * P], axis=-1)
    rows_y = np.concatenate([zero, P, -q[..., 1:] * P], axis=-1)
    rows = np.concatenate([rows_x, rows_y], axis=-2)
    _, vectors = np.linalg.eigh(np.swapaxes(rows, -1, -2) @ rows)
    H = vectors[..., 0].reshape(*vectors.shape[:-2], 3, 3)
    H = np.linalg.solve(to_image, H @ to_plane)
    centre = np.sum(plane * weight[..., None], axis=-2) / np.sum(weight, axis=-1)[..., None]
    depth = np.sum(H[..., 2, :2] * centre, axis=-1) + H[..., 2, 2]
    scale = np.where(depth < 0, -1.0, 1.0) / np.linalg.norm(H, axis=(-2, -1))
    return np.asarray(H * scale[..., None, None])


def _conditioned(points: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    total = np.sum(weight, axis=-1)[..., None]
    mean = np.sum(points * weight[..., None], axis=-2) / total
    moved = points - mean[..., None, :]
    spread = np.sqrt(np.sum(moved**2 * weight[..., None], axis=(-2, -1)) / total[..., 0] / 2)
    spread = np.maximum(spread, 1e-12)
    T = np.zeros((*spread.shape, 3, 3))
    T[..., 0, 0] = T[..., 1, 1] = 1.0 / spread
    T[..., :2, 2] = -mean / spread[..., None]
    T[..., 2, 2] = 1.0
    return T, moved / spread[..., None, None]


def pose_from_homography(H: FloatArray) -> FloatArray:
    """Return the (..., 4, 4) poses nearest to homographies from the target plane to directions."""
    a, b = H[..., :, 0], H[..., :, 1]
    scale = 2.0 / (np.linalg.norm(a, axis=-1) + np.linalg.norm(b, axis=-1))
    R = rotations.project_to_so3(np.stack([a, b, np.cross(a, b) * scale[..., None]], axis=-1))
    return se3.from_parts(R, H[..., :, 2] * scale[..., None])


def _mirrored(poses: FloatArray, seen: Sightings) -> FloatArray:
    weight = _weights(seen.mask)
    here = se3.transform_points(poses, seen.points)
    centre = np.sum(here * weight[..., None], axis=-2)
    sight = centre / np.maximum(np.linalg.norm(centre, axis=-1, keepdims=True), 1e-300)
    mirror = np.eye(3) - 2.0 * sight[..., :, None] * sight[..., None, :]
    R = mirror @ poses[..., :3, :3] * np.array([1.0, 1.0, -1.0])
    middle = np.sum(seen.points * weight[..., None], axis=-2)
    return se3.from_parts(R, centre - (R @ middle[..., None])[..., 0])


def residuals(
    poses: FloatArray, seen: Sightings, lens: Lens
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the pixel residuals of every view and their derivatives.

    Args:
        poses: (..., 4, 4) camera_T_target.
        seen: The views.
        lens: Intrinsics.

    Returns:
        (..., n, 2) projected minus measured, zero for points not seen, (..., n, 2, 6) derivatives
        by the pose's perturbation in the camera frame, (..., n, 2, 4 + k) by the intrinsics.
    """
    lever = seen.points @ np.swapaxes(poses[..., :3, :3], -1, -2)
    here = lever + poses[..., None, :3, 3]
    projected, by_point, by_parameters = project_jacobians(here, *_parts(lens))
    by_pose = np.concatenate([by_point, -by_point @ rotations.skew(lever)], axis=-1)
    keep = seen.mask[..., None]
    return (
        np.where(keep, projected - seen.pixels, 0.0),
        np.where(keep[..., None], by_pose, 0.0),
        np.where(keep[..., None], by_parameters, 0.0),
    )


def squared_residuals(poses: FloatArray, seen: Sightings, lens: Lens) -> FloatArray:
    """Return each view's sum of squared pixel residuals, infinite for a target behind the camera.

    The arguments are those of `residuals`; the result has shape (...).
    """
    here = se3.transform_points(poses, seen.points)
    error = project(here, *_parts(lens)) - seen.pixels
    total = np.sum(np.where(seen.mask[..., None], error, 0.0) ** 2, axis=(-2, -1))
    behind = np.any(seen.mask & (here[..., 2] <= 0), axis=-1)
    return np.where(behind | ~np.isfinite(total), np.inf, total)


def refine(start: FloatArray, seen: Sightings, lens: Lens) -> tuple[FloatArray, FloatArray]:
    """Minimise the squared pixel residuals of every view over its pose (Levenberg-Marquardt).

    Args:
        start: (..., 4, 4) first guesses of camera_T_target.
        seen: The views.
        lens: Intrinsics.

    Returns:
        (..., 4, 4) poses and (...) sums of squared residuals, infinite for a target behind the
        camera.
    """
    # About the middle of what was seen, turning and shifting hardly depend on each other.
    weight = _weights(seen.mask)
    middle = np.sum(seen.points * weight[..., None], axis=-2)
    seen = replace(seen, points=seen.points - middle[..., None, :])
    poses = start @ se3.from_parts(np.eye(3), middle)
    squares = squared_residuals(poses, seen, lens)
    damping = np.full(squares.shape, 1e-4)
    for _ in range(_MAX_STEPS):
        r, J, _ = residuals(poses, seen, lens)
        normal = np.einsum("...nki,...nkj->...ij", J, J)
        gradient = np.einsum("...nki,...nk->...i", J, r)
        step = -_damped_step(normal, gradient, damping)
        tried = se3.perturb(poses, step)
        tried_squares = squared_residuals(tried, seen, lens)
        better = tried_squares <= squares
        poses = np.where(better[..., None, None], tried, poses)
        squares = np.where(better, tried_squares, squares)
        damping = np.where(better, damping * 0.1, np.minimum(damping * 10.0, _HOPELESS))
        gain = np.abs(np.sum(step * gradient, axis=-1))
        small = gain <= _GAIN_TOLERANCE * squares + 1e-22
        if np.all(small | (damping >= _HOPELESS)):
            break
    return poses @ se3.from_parts(np.eye(3), -middle), squares


def _damped_step(normal: FloatArray, gradient: FloatArray, damping: FloatArray) -> FloatArray:
    """Solve the normal equations with their diagonal raised; no step where they are not finite."""
    lost = ~np.isfinite(np.sum(normal, axis=(-2, -1)) + np.sum(gradient, axis=-1))
    size = np.einsum("...ii->...i", normal)
    scale = np.where(lost[..., None] | (size <= 0), 1.0, 1.0 / np.sqrt(np.maximum(size, 1e-300)))
    normal = np.where(lost[..., None, None], 0.0, normal)
    scaled = scale[..., :, None] * normal * scale[..., None, :]
    right = np.where(lost[..., None], 0.0, scale * gradient)
    raised = scaled + (damping + 1e-15)[..., None, None] * np.eye(6)
    return np.asarray(scale * np.linalg.solve(raised, right[..., None])[..., 0])


def pose_information(poses: FloatArray, seen: Sightings, lens: Lens) -> FloatArray:
    """Return the (..., 6, 6) information on each pose for pixel noise of one pixel.

    Its inverse times the pixel variance is the covariance of the pose.
    """
    _, J, _ = residuals(poses, seen, lens)
    return np.asarray(np.einsum("...nki,...nkj->...ij", J, J))
