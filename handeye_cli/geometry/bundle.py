"""Intrinsics and target poses from the same views: planar camera calibration.

The first guess comes from the homographies' two orthogonality constraints (Zhang), the refinement
is Levenberg-Marquardt on all pixels, with the poses eliminated view by view (Schur complement).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import pnp, se3
from handeye_cli.geometry.camera import Lens
from handeye_cli.geometry.pnp import Sightings

FloatArray = NDArray[np.float64]

_MAX_STEPS = 200
_HOPELESS = 1e12
GAIN_TOLERANCE = 1e-12
"""Part of the squares by which a step lessens them where they are settled."""


@dataclass(frozen=True)
class BundleResult:
    """Calibrated intrinsics with the poses of all views.

    Attributes:
        parameters: (4 + k,) intrinsics.
        poses: (N, 4, 4) camera_T_target.
        squares: Sum of squared pixel residuals.
        information: (4 + k, 4 + k) on the intrinsics, poses eliminated, for noise of one pixel.
        converged: Whether the last step no longer gained anything.
    """

    parameters: FloatArray
    poses: FloatArray
    squares: float
    information: FloatArray
    converged: bool


def focal_length(homographies: FloatArray, width: int, height: int) -> float | None:
    """Return the focal length in pixels from homographies target plane -> pixels.

    Square pixels and a principal point in the middle of the image are assumed, so each view gives
    two linear equations in 1 / f^2: the plane's axes are orthogonal and of one length.

    Args:
        homographies: (N, 3, 3).
        width: Image width in pixels.
        height: Image height in pixels.

    Returns:
        The focal length, or None when no view is tilted enough to tell.
    """
    centred = np.eye(3)
    centred[:2, 2] = [-(width - 1) / 2, -(height - 1) / 2]
    H = centred @ homographies
    H = H / np.linalg.norm(H[..., :2], axis=(-2, -1), keepdims=True)
    a, b = H[..., 0], H[..., 1]
    across = np.stack([np.sum(a[:, :2] * b[:, :2], axis=1), np.sum((a * a - b * b)[:, :2], axis=1)])
    along = np.stack([a[:, 2] * b[:, 2], a[:, 2] ** 2 - b[:, 2] ** 2])
    inverse_square = -float(np.sum(across * along) / max(float(np.sum(across**2)), 1e-300))
    if not inverse_square > 0 or inverse_square < 1.0 / (100.0 * max(width, height)) ** 2:
        return None
    return float(1.0 / np.sqrt(inverse_square))


def calibrate(
    seen: Sightings, lens: Lens, poses: FloatArray, tolerance: float = GAIN_TOLERANCE
) -> BundleResult:
    """Minimise all squared pixel residuals over the intrinsics and one pose per view.

    Args:
        seen: (N, ...) views.
        lens: First guess; its length says how many coefficients are estimated.
        poses: (N, 4, 4) first guess of camera_T_target.
        tolerance: Part of the squares by which a step has to lessen them, or it is the last.
    """
    squares = _total(poses, seen, lens)
    damping, converged = 1e-4, False
    for _ in range(_MAX_STEPS):
        step_shared, step_poses, gain = _step(_normal_blocks(poses, seen, lens), damping)
        tried = replace(lens, parameters=lens.parameters + step_shared)
        tried_poses = se3.perturb(poses, step_poses)
        tried_squares = _total(tried_poses, seen, tried)
        if tried_squares <= squares:
            lens, poses, squares = tried, tried_poses, tried_squares
            damping = max(damping * 0.1, 1e-12)
        else:
            damping *= 10.0
        converged = gain <= tolerance * squares + 1e-20
        if converged or damping > _HOPELESS:
            break
    blocks = _normal_blocks(poses, seen, lens)
    back = np.linalg.solve(blocks.own, np.swapaxes(blocks.cross, -1, -2))
    information = blocks.shared - np.einsum("nij,njk->ik", blocks.cross, back)
    return BundleResult(lens.parameters, poses, squares, information, converged)


def _total(poses: FloatArray, seen: Sightings, lens: Lens) -> float:
    total = float(np.sum(pnp.squared_residuals(poses, seen, lens)))
    return total if np.all(lens.parameters[:2] > 0) else np.inf


@dataclass(frozen=True)
class _Blocks:
    """Normal equations: intrinsics, intrinsics by pose, poses, and the gradients of both."""

    shared: FloatArray
    cross: FloatArray
    own: FloatArray
    shared_gradient: FloatArray
    own_gradient: FloatArray


def _normal_blocks(poses: FloatArray, seen: Sightings, lens: Lens) -> _Blocks:
    r, J, K = pnp.residuals(poses, seen, lens)
    return _Blocks(
        shared=np.einsum("nmki,nmkj->ij", K, K),
        cross=np.einsum("nmki,nmkj->nij", K, J),
        own=np.einsum("nmki,nmkj->nij", J, J),
        shared_gradient=np.einsum("nmki,nmk->i", K, r),
        own_gradient=np.einsum("nmki,nmk->ni", J, r),
    )


def _step(blocks: _Blocks, damping: float) -> tuple[FloatArray, FloatArray, float]:
    own = blocks.own * (1.0 + damping * np.eye(6))
    shared = blocks.shared * (1.0 + damping * np.eye(len(blocks.shared)))
    right = np.concatenate(
        [np.swapaxes(blocks.cross, -1, -2), blocks.own_gradient[..., None]], axis=-1
    )
    back = np.linalg.solve(own, right)
    reduced = shared - np.einsum("nij,njk->ik", blocks.cross, back[..., :-1])
    gradient = blocks.shared_gradient - np.einsum("nij,nj->i", blocks.cross, back[..., -1])
    step = -np.linalg.solve(reduced, gradient)
    step_poses = -back[..., -1] - back[..., :-1] @ step
    gain = -float(step @ blocks.shared_gradient + np.sum(step_poses * blocks.own_gradient))
    return step, step_poses, gain
