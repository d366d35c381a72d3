"""The signs of the motions' quaternions, which a rotation near pi leaves open.

q and -q are the same rotation. With w >= 0 the sign is settled, but around an angle of pi noise may
turn the axis of one side of `H_g X = X H_c` round and not that of the other. A rough rotation from
two axes tells which signs belong together.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from handeye_cli.geometry import rotations
from handeye_cli.solvers.problem import FloatArray
from handeye_cli.solvers.translation import least_squares, translation_system

_NEAR_PI = 0.99
"""Length of a quaternion's vector part above which its sign is taken from the rough solution."""
_AS_GOOD = 1000.0
"""Squared misfit, in that of the best rotation, up to which the translations have the last word:
noise makes the misfits of equally right rotations differ widely, wrong ones are off by radians."""
_SIGNS = np.array(list(product((1.0, -1.0), repeat=2)))


def signed_quaternions(
    motion_g: FloatArray, motion_c: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the motions' quaternions with matching signs, and the rough rotation behind them.

    Args:
        motion_g: (..., m, 4, 4) motions of the mount.
        motion_c: (..., m, 4, 4) motions of the camera.

    Returns:
        (..., m, 4) quaternions x y z w of both, whose vector parts are half the axes of eq. (9),
        and the (..., 3, 3) rough R_cg. Near pi the camera's w may be negative.
    """
    q_g = rotations.quaternion_from_matrix(motion_g[..., :3, :3])
    q_c = rotations.quaternion_from_matrix(motion_c[..., :3, :3])
    rough = rough_rotation(motion_g, motion_c)
    carried = q_c[..., :3] @ np.swapaxes(rough, -1, -2)
    opposite = np.sum(carried * q_g[..., :3], axis=-1) < 0
    near_pi = np.linalg.norm(q_g[..., :3], axis=-1) > _NEAR_PI
    return q_g, np.where((opposite & near_pi)[..., None], -q_c, q_c), rough


def axis_jacobian(q: FloatArray) -> FloatArray:
    """Return the derivative of a quaternion's vector part by a turn in the parent frame.

    Args:
        q: (..., 4) quaternions x y z w of either sign.

    Returns:
        (..., 3, 3) matrices.
    """
    return np.asarray(0.5 * (q[..., 3, None, None] * np.eye(3) - rotations.skew(q[..., :3])))


def rough_rotation(motion_g: FloatArray, motion_c: FloatArray) -> FloatArray:
    """Return R_cg from the two most different axes, with the signs that fit all motions best.

    Half turns about perpendicular axes leave four rotations that fit all rotations alike; then the
    one that fits the translations is taken.

    Args:
        motion_g: (..., m, 4, 4) motions of the mount.
        motion_c: (..., m, 4, 4) motions of the camera.

    Returns:
        (..., 3, 3) rotations.
    """
    R = _candidates(motion_g, motion_c)
    motion_g, motion_c = motion_g[..., None, :, :, :], motion_c[..., None, :, :, :]
    turned = R[..., None, :, :] @ motion_c[..., :3, :3]
    misfit = np.sum((motion_g[..., :3, :3] @ R[..., None, :, :] - turned) ** 2, axis=(-3, -2, -1))
    rows, right = translation_system(R, motion_g, motion_c)
    found = least_squares(rows, right)[..., None, :, None]
    left = right - (rows @ found)[..., 0]
    best = np.min(misfit, axis=-1, keepdims=True)
    possible = misfit <= _AS_GOOD * best + 1e-9 * motion_g.shape[-3]
    cost = np.where(possible, np.sum(left**2, axis=(-2, -1)), np.inf)
    chosen = np.argmin(cost, axis=-1)[..., None, None, None]
    return np.take_along_axis(R, chosen, axis=-3)[..., 0, :, :]


def _candidates(motion_g: FloatArray, motion_c: FloatArray) -> FloatArray:
    """Return the (..., 4, 3, 3) rotations that two axes allow, one for each choice of signs."""
    P_g = rotations.principal_axis(motion_g[..., :3, :3])
    P_c = rotations.principal_axis(motion_c[..., :3, :3])
    first = np.argmax(np.linalg.norm(P_g, axis=-1), axis=-1)[..., None, None]
    area = np.linalg.norm(np.cross(P_g, np.take_along_axis(P_g, first, axis=-2)), axis=-1)
    second = np.argmax(area, axis=-1)[..., None, None]
    index = np.concatenate([first, second], axis=-2)
    a, b = np.take_along_axis(P_g, index, axis=-2), np.take_along_axis(P_c, index, axis=-2)
    return rotations.align(a[..., None, :, :], _SIGNS[..., None] * b[..., None, :, :])
