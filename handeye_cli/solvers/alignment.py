"""R_cg as the rotation that carries the camera's rotation axes onto the mount's, `a = R b`.

Every measure of a motion's rotation that turns along with the frame can serve as the vector: the
logarithm, or the vector part of the quaternion. Axes in one plane are enough: the rotation is the
nearest one *with determinant +1*, so the missing third direction follows from the other two.
"""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry import rotations
from handeye_cli.solvers.problem import FloatArray


def align_axes(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the (..., 3, 3) rotations that minimise `sum |a - R b|^2`.

    Args:
        a: (..., m, 3) vectors of the mount's motions.
        b: (..., m, 3) those of the camera's.
    """
    return rotations.project_to_so3(np.swapaxes(a, -1, -2) @ b)


def alignment_influence(
    R: FloatArray, b: FloatArray, a_by_turn: FloatArray, b_by_turn: FloatArray
) -> FloatArray:
    """Return (m, 3, 12): the perturbation of R by those of H_gij and H_cij.

    A turn d of R changes the residual `a - R b` by `skew(R b) d`, so least squares moves by its
    pseudo-inverse times the change of the residuals.

    Args:
        R: (3, 3) rotation.
        b: (m, 3) vectors of the camera's motions.
        a_by_turn: (m, 3, 3) derivative of the mount's vectors by turns of H_gij.
        b_by_turn: (m, 3, 3) that of the camera's vectors by turns of H_cij.
    """
    back = np.linalg.pinv(rotations.skew(b @ R.T).reshape(-1, 3)).reshape(3, -1, 3)
    row = np.zeros((len(b), 3, 12))
    row[:, :, 3:6] = -np.einsum("imk,mkl->mil", back, a_by_turn)
    row[:, :, 9:] = np.einsum("imk,kj,mjl->mil", back, R, b_by_turn)
    return row
