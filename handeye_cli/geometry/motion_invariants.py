"""How well robot and camera make the same motions, with no noise model and no start.

Every function takes any leading axes, so that many readings of the same numbers are fitted at once.
The loop `A_i X B_i = Z` gives each station one residual, whatever the number of pairs, and needs no
rotation axes, whose sign is open for half turns. Stations are weighted down as they disagree, and
those that agree best are fitted with least squares at the end: a minority of bad ones has no say.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

_ROUNDS = 8
"""Rounds of reweighting, by which bad stations have lost their weight."""
_REFITS = 3
"""Least-squares fits to the stations that agree best, each choosing them anew."""
_SOFT = 0.3
"""Residuals below this share of the typical one are not told apart."""
_ALTERNATIONS = 10
"""Turns of fitting R_Z to R_X and back, after which a candidate is where it fits best."""
_IRRATIONAL = 0.5 * (np.sqrt(5.0) - 1.0)
"""Its multiples are spread evenly, and no motions have such weights by themselves."""
_TINY = 1e-12
_OPEN = 1e-9
"""Share of the largest eigenvalue below which a direction of the translation is not fitted."""


class RotationFit(NamedTuple):
    """The rotations that close the loops best.

    Attributes:
        R_X: (..., 3, 3) mount_R_camera.
        R_Z: (..., 3, 3) reference_R_target.
        residuals: (..., N) angle of each station's loop, radians; infinite where it is masked.
        rms: (...) RMS of the residuals of the stations that agree best, radians.
        kept: (..., N) these stations.
    """

    R_X: FloatArray
    R_Z: FloatArray
    residuals: FloatArray
    rms: FloatArray
    kept: BoolArray


class TranslationFit(NamedTuple):
    """The translations that close the loops best, lengths of robot and camera in a free ratio.

    The residuals are lengths half-way between the robot's and the camera's, their geometric mean:
    then neither a large nor a small unit of one side makes a fit look better.

    Attributes:
        t_X: (..., 3) translation of mount_T_camera with the lengths as they are.
        t_Z: (..., 3) that of reference_T_target.
        by_camera: (..., 3) part of t_X that grows with the camera's lengths.
        ratio: (...) lengths of the robot over those of the camera.
        correlation: (...) between what both sides say about the ratio, -1 to 1.
        residuals: (..., N) of the stations with that ratio; infinite where a station is masked.
        rms: (...) RMS of the residuals of the stations that agree best.
        apart: (...) the same with a ratio of 1, metres.
        reach: (...) RMS length of the motions that were to be matched, half-way as the residuals.
    """

    t_X: FloatArray
    t_Z: FloatArray
    by_camera: FloatArray
    ratio: FloatArray
    correlation: FloatArray
    residuals: FloatArray
    rms: FloatArray
    apart: FloatArray
    reach: FloatArray


def pair_angles(R: FloatArray) -> FloatArray:
    """Return the (..., N, N) angles between (..., N, 3, 3) rotations, radians.

    They are the same for robot and camera, whatever the answer is and whichever way round the poses
    are; only lists that do not belong together and wrong numbers of a rotation change them.
    """
    return rotations.angle(np.swapaxes(R, -1, -2)[..., :, None, :, :] @ R[..., None, :, :, :])


def second_turn(R: FloatArray, kept: BoolArray) -> FloatArray:
    """Return how far rotations turn across the axis that they turn about most.

    The quaternions of rotations about one axis lie on a great circle, wherever they start.

    Args:
        R: (..., N, 3, 3) rotations.
        kept: (..., N) which of them count.

    Returns:
        (...) RMS angle in radians; zero for rotations about one axis.
    """
    q = rotations.quaternion_from_matrix(R) * kept[..., None]
    moments = np.linalg.eigvalsh(np.swapaxes(q, -1, -2) @ q)
    count = np.maximum(np.sum(kept, axis=-1), 1)
    return np.asarray(2.0 * np.sqrt(np.maximum(moments[..., 1], 0.0) / count))


def fit_rotations(A: FloatArray, B: FloatArray, mask: BoolArray, keep: IntArray) -> RotationFit:
    """Find `A_i R_X B_i = R_Z` for the stations that agree best.

    The elements of both rotations are the leading singular vectors of `sum kron(A_i, B_i)`.

    Args:
        A: (..., N, 3, 3) reference_R_mount.
        B: (..., N, 3, 3) camera_R_target.
        mask: (..., N) stations that exist.
        keep: (...) number of stations that are trusted to agree.
    """
    weights, residuals, rms, kept = _agreeing(
        lambda weights: _angles(A, B, *_rotations(A, B, weights)), mask, mask, keep
    )
    R_X, R_Z = _rotations(A, B, weights)
    return RotationFit(R_X, R_Z, np.where(mask, residuals, np.inf), rms, kept)


def turned_answers(
    A: FloatArray, B: FloatArray, found: RotationFit, mask: BoolArray, keep: IntArray
) -> RotationFit:
    """Return what else may fit as well as rotations that were found, as half turns allow it.

    The rotations of stations between which there are half turns may fit R_X and R R_X alike. R is a
    half turn about the axis of all motions that are none, which is along or across those of all
    others: an eigenvector of the symmetric part of every motion, and of a sum of them with weights
    that nothing explains. The other two eigenvectors of that are tried for nothing.

    Args:
        A: (..., N, 3, 3) reference_R_mount.
        B: (..., N, 3, 3) camera_R_target.
        found: One solution.
        mask: (..., N) stations that exist.
        keep: (...) number of stations that are trusted to agree.

    Returns:
        Three candidates along a further axis, (..., 3), each refined to where it fits best.
    """
    first = np.argmax(found.kept, axis=-1)[..., None, None, None]
    motions = np.swapaxes(np.take_along_axis(A, first, axis=-3), -1, -2) @ A
    weights = np.modf(np.arange(1, A.shape[-3] + 1) * _IRRATIONAL)[0] * found.kept
    total = np.einsum("...n,...nij->...ij", weights, motions)
    _, axes = np.linalg.eigh(total + np.swapaxes(total, -1, -2))
    half = rotations.exp(np.pi * np.swapaxes(axes, -1, -2))
    A, B = A[..., None, :, :, :], B[..., None, :, :, :]
    chosen = found.kept[..., None, :, None, None]
    R_X = half @ found.R_X[..., None, :, :]
    for _ in range(_ALTERNATIONS):
        R_Z = rotations.project_to_so3(np.sum(chosen * (A @ R_X[..., None, :, :] @ B), axis=-3))
        back = np.swapaxes(A, -1, -2) @ R_Z[..., None, :, :] @ np.swapaxes(B, -1, -2)
        R_X = rotations.project_to_so3(np.sum(chosen * back, axis=-3))
    residuals = np.where(mask[..., None, :], _angles(A, B, R_X, R_Z), np.inf)
    kept, _ = _best(residuals, mask[..., None, :], keep[..., None])
    squares = np.where(kept, residuals, 0.0)[..., None]
    return RotationFit(R_X, R_Z, residuals, np.sqrt(_square(squares, kept.astype(float))), kept)


def fit_translations(
    A: FloatArray, B: FloatArray, turned: RotationFit, mask: BoolArray, keep: IntArray
) -> TranslationFit:
    """Find `A_i X B_i = Z` with the rotations known and a free ratio of lengths.

    With the translations of X and Z eliminated each station has one vector of the robot's lengths
    and one of the camera's, which differ by the ratio. On a circle about the target both vanish:
    such stations do not tell the ratio.

    Args:
        A: (..., N, 4, 4) reference_T_mount.
        B: (..., N, 4, 4) camera_T_target.
        turned: The rotations; the stations they rest on are where the search starts.
        mask: (..., N) stations that exist.
        keep: (...) number of stations that are trusted to agree.
    """
    carried = turned.R_X[..., None, :, :] @ B[..., :3, 3:]
    by_robot, by_camera = A[..., :3, 3], (A[..., :3, :3] @ carried)[..., 0]

    def residuals_of(weights: FloatArray) -> FloatArray:
        parts = _eliminated(A[..., :3, :3], by_robot, by_camera, weights)
        return parts.residuals(weights)

    weights, residuals, rms, _ = _agreeing(residuals_of, turned.kept, mask, keep)
    parts = _eliminated(A[..., :3, :3], by_robot, by_camera, weights)
    t_X = parts.by_robot + parts.by_camera
    closed = (A[..., :3, :3] @ t_X[..., None, :, None])[..., 0] + by_robot + by_camera
    return TranslationFit(
        t_X=t_X,
        t_Z=_mean(closed, weights)[..., 0, :],
        by_camera=parts.by_camera,
        ratio=parts.ratio(weights),
        correlation=parts.correlation(weights),
        residuals=np.where(mask, residuals, np.inf),
        rms=rms,
        apart=np.sqrt(_square(parts.robot + parts.camera, weights)),
        reach=parts.reach(weights),
    )


def _agreeing(
    residuals_of: Callable[[FloatArray], FloatArray],
    start: BoolArray,
    mask: BoolArray,
    keep: IntArray,
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Return weights, residuals, RMS and choice of the `keep` stations that agree best."""
    settled = residuals_of(start.astype(float))
    routes = [_refitted(residuals_of, settled, mask, keep)]
    for _ in range(_ROUNDS):
        _, typical = _best(settled, mask, keep)
        soft = np.maximum(_SOFT * typical, _TINY)[..., None]
        settled = residuals_of(mask / np.maximum(settled, soft) ** 2)
    routes.append(_refitted(residuals_of, settled, mask, keep))
    second = routes[1][2] < routes[0][2]
    weights, residuals, rms = (
        np.where(second[(..., *[None] * (one.ndim - second.ndim))], other, one)
        for one, other in zip(*routes, strict=True)
    )
    return weights, residuals, rms, weights > 0.0


def _refitted(
    residuals_of: Callable[[FloatArray], FloatArray],
    residuals: FloatArray,
    mask: BoolArray,
    keep: IntArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return weights, residuals and RMS after least squares on the stations that agree best."""
    for _ in range(_REFITS):
        weights = _best(residuals, mask, keep)[0].astype(float)
        residuals = residuals_of(weights)
    return weights, residuals, np.sqrt(_square(residuals[..., None], weights))


def _best(residuals: FloatArray, mask: BoolArray, keep: IntArray) -> tuple[BoolArray, FloatArray]:
    """Return the `keep` smallest residuals, and the largest of them."""
    limited = np.where(mask, residuals, np.inf)
    ranks = np.argsort(np.argsort(limited, axis=-1, kind="stable"), axis=-1)
    kept = ranks < keep[..., None]
    return kept, np.max(np.where(kept, residuals, 0.0), axis=-1)


def _rotations(A: FloatArray, B: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    batch, count = weights.shape[:-1], weights.shape[-1]
    left = (weights[..., None, None] * A).reshape(*batch, count, 9)
    products = np.swapaxes(left, -1, -2) @ B.reshape(*B.shape[:-3], count, 9)
    # Z_il = A_ij X_jk B_kl: rows are the elements il, columns jk
    kron = np.moveaxis(products.reshape(*batch, 3, 3, 3, 3), -1, -3)
    _, _, right = np.linalg.svd(kron.reshape(*batch, 9, 9))
    X = right[..., 0, :].reshape(*batch, 3, 3)
    R_X = rotations.project_to_so3(X * np.sign(np.linalg.det(X))[..., None, None])
    closed = np.sum(weights[..., None, None] * (A @ R_X[..., None, :, :] @ B), axis=-3)
    return R_X, rotations.project_to_so3(closed)


def _angles(A: FloatArray, B: FloatArray, R_X: FloatArray, R_Z: FloatArray) -> FloatArray:
    """Return the (..., N) angles of the loops."""
    apart = A @ R_X[..., None, :, :] @ B - R_Z[..., None, :, :]
    chord = np.sqrt(np.sum(apart**2, axis=(-2, -1)) / 8.0)
    return np.asarray(2.0 * np.arcsin(np.minimum(chord, 1.0)))


class _Eliminated(NamedTuple):
    """The translations of the loops without those of X and Z.

    Attributes:
        robot: (..., N, 3) the robot's share in them; `ratio * camera + robot` vanishes.
        camera: (..., N, 3) the camera's.
        by_robot: (..., 3) the t_X that each side has taken up.
        by_camera: (..., 3) the same of the camera.
        robot_motion: (..., N, 3) the shares before t_X was eliminated.
        camera_motion: (..., N, 3) the same of the camera.
    """

    robot: FloatArray
    camera: FloatArray
    by_robot: FloatArray
    by_camera: FloatArray
    robot_motion: FloatArray
    camera_motion: FloatArray

    def reach(self, weights: FloatArray) -> FloatArray:
        lengths = _square(self.robot_motion, weights) * _square(self.camera_motion, weights)
        return np.asarray(lengths**0.25)

    def ratio(self, weights: FloatArray) -> FloatArray:
        robot, camera = _square(self.robot, weights), _square(self.camera, weights)
        return np.sqrt((robot + _TINY**2) / (camera + _TINY**2))

    def correlation(self, weights: FloatArray) -> FloatArray:
        product = -np.sum(weights * np.sum(self.robot * self.camera, axis=-1), axis=-1)
        total = np.sqrt(_square(self.robot, weights) * _square(self.camera, weights))
        return np.asarray(product / (np.sum(weights, axis=-1) * total + _TINY**2))

    def residuals(self, weights: FloatArray) -> FloatArray:
        root = np.sqrt(self.ratio(weights))[..., None, None]
        return np.asarray(np.linalg.norm(self.robot / root + root * self.camera, axis=-1))


def _eliminated(
    R: FloatArray, robot: FloatArray, camera: FloatArray, weights: FloatArray
) -> _Eliminated:
    """Take the best t_X and t_Z out of `R t_X + robot + camera = t_Z`."""
    R = R - _mean(R.reshape(*R.shape[:-2], 9), weights).reshape(*weights.shape[:-1], 1, 3, 3)
    robot, camera = robot - _mean(robot, weights), camera - _mean(camera, weights)
    weighted = weights[..., None, None] * R
    normal = np.einsum("...nij,...nik->...jk", weighted, R)
    sides = [np.einsum("...nij,...ni->...j", weighted, side) for side in (robot, camera)]
    back = np.linalg.pinv(normal, rcond=_OPEN, hermitian=True)
    shifts = [-(back @ side[..., None])[..., 0] for side in sides]
    left = [
        side + (R @ shift[..., None, :, None])[..., 0]
        for side, shift in zip((robot, camera), shifts, strict=True)
    ]
    return _Eliminated(
        robot=left[0],
        camera=left[1],
        by_robot=shifts[0],
        by_camera=shifts[1],
        robot_motion=robot,
        camera_motion=camera,
    )


def _mean(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the weighted mean over the stations, (..., 1, k) of (..., N, k)."""
    total = np.sum(weights, axis=-1)[..., None, None]
    return np.asarray(np.sum(weights[..., None] * values, axis=-2, keepdims=True) / total)


def _square(vectors: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the (...) weighted mean square length of (..., N, k) vectors."""
    lengths = np.sum(vectors**2, axis=-1)
    return np.asarray(np.sum(weights * lengths, axis=-1) / np.sum(weights, axis=-1))
