"""Which directions of the answer the stations leave free, judged against what noise would feign.

A twist of X that commutes with every motion of the mount can be undone by moving Z along, so
nothing measures it. For motions (R, t) it is a translation along d with `R d = d`, or a rotation
about an axis w with `R w = w` that the translations t do not turn either. So every free rotation
has the axis of a free translation, and the two are looked for one after the other:

    rotations about two axes                nothing is free
    rotations about one axis a              the translation along a, and the rotation about it
                                            unless translations across it (SCARA) settle that
    no rotation                             all translations; of the rotation all (no motion), that
                                            about the only direction of translation, or none

Noisy poses never leave a direction quite free: the noise itself looks like a little motion. In a
direction u the information is `sum |L_i^-1 J_i u|^2`, and noise alone makes its expectation
`sum E |L_i^-1 dJ_i u|^2`; only what exceeds that by far is motion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import rotations
from handeye_cli.geometry.whitened_loop import WhitenedLoops

FloatArray = NDArray[np.float64]

_SIGNIFICANCE = 4.0
"""Motion has to exceed what noise feigns by this factor, in amplitude."""
_LARGEST_SIGMA = 0.35
"""A rotation less certain than this (radians) is as good as free."""


@dataclass(frozen=True)
class Freedom:
    """The free directions of X = mount_T_camera, as orthonormal rows in the mount's frame.

    Attributes:
        rotations: (r, 3) axes; r is 0, 1 or 3.
        translations: (k, 3) directions; k is 0, 1 or 3.
    """

    rotations: FloatArray
    translations: FloatArray

    @property
    def counts(self) -> tuple[int, int]:
        """How many rotations and translations are free."""
        return len(self.rotations), len(self.translations)

    @property
    def basis(self) -> FloatArray:
        """(12, p) orthonormal basis of the steps of X and Z that hold the free directions."""
        basis = np.zeros((12, 12 - sum(self.counts)))
        across, turns = complement(self.translations), complement(self.rotations)
        edge = across.shape[1]
        basis[:3, :edge], basis[3:6, edge:-6], basis[6:, -6:] = across, turns, np.eye(6)
        return basis


NOTHING_FREE = Freedom(np.zeros((0, 3)), np.zeros((0, 3)))
NOTHING_DETERMINED = Freedom(np.eye(3), np.eye(3))


def fewest_free(stations: int) -> tuple[int, int]:
    """Return how many rotations and translations stay free at least, whatever the motions.

    One station has no motion, two have a single screw.
    """
    if stations < 2:
        return 3, 3
    return (1, 1) if stations == 2 else (0, 0)


def complement(rows: FloatArray) -> FloatArray:
    """Return (3, 3 - k) orthonormal columns across k orthonormal rows of (k, 3)."""
    return np.asarray(np.linalg.svd(rows, full_matrices=True)[2][len(rows) :].T)


def free_directions(
    loops: WhitenedLoops,
    covariance: FloatArray,
    *,
    A: FloatArray,
    X: FloatArray,
    B: FloatArray,
    least: tuple[int, int] = (0, 0),
) -> Freedom:
    """Return the directions of X that the loops of N stations leave free.

    Args:
        loops: The loops, linearised where they nearly close.
        covariance: (N, 12, 12) of the perturbations of A_i and B_i.
        A: (N, 4, 4) reference_T_mount.
        X: (4, 4) mount_T_camera.
        B: (N, 4, 4) camera_T_target.
        least: Rotations and translations that are free in any case.
    """
    constant, upper = np.linalg.qr(loops.design[..., 6:].reshape(-1, 6))
    answer = loops.design[..., :6].reshape(-1, 6)
    along = np.concatenate([np.eye(6), -np.linalg.solve(upper, constant.T @ answer)])
    answer = answer - constant @ (constant.T @ answer)
    moved = design_noise(loops.root, A=A, X=X, B=B) @ along
    feigned = _SIGNIFICANCE**2 * feigned_information(moved, constant, covariance)
    moves = _weak(answer[:, :3], feigned[:3, :3], max(least))
    if len(moves) == 0:
        return NOTHING_FREE
    # what a turn changes cannot be told from a translation that is itself open to fitting
    turned, settled = answer[:, 3:] @ moves.T, complement(moves)
    fit = np.linalg.pinv(answer[:, :3] @ settled) @ turned
    turns = np.concatenate([-settled @ fit, moves.T])
    limit = turns.T @ feigned @ turns + np.eye(len(moves)) / _LARGEST_SIGMA**2
    axes = _weak(turned - answer[:, :3] @ settled @ fit, limit, least[0])
    return Freedom(axes @ moves, moves)


def _weak(columns: FloatArray, limit: FloatArray, least: int) -> FloatArray:
    """Return the orthonormal directions u, as rows, in which `|columns u|^2 <= u' limit u`.

    Args:
        columns: (m, n) with n 1 or 3.
        limit: (n, n), positive definite.
        least: How many of the weakest are returned in any case.
    """
    unit = np.linalg.inv(np.linalg.cholesky(limit))
    _, size, rows = np.linalg.svd(columns @ unit.T, full_matrices=False)
    count = max(int(np.sum(size <= 1.0)), min(least, len(limit)))
    if count in (0, len(limit)):
        return np.eye(len(limit))[:count]
    if count == 2:  # no motion leaves two of three: the third is free as well, by its noise
        return np.eye(3)
    weakest = rows[-1] @ unit
    weakest = weakest * np.sign(weakest[np.argmax(np.abs(weakest))])
    return np.asarray(weakest / np.linalg.norm(weakest))[None]


def design_noise(root: FloatArray, *, A: FloatArray, X: FloatArray, B: FloatArray) -> FloatArray:
    """Return how the whitened design of loops moves with the errors of the stations' poses.

    The rows of the translation, `[R_A, -R_A skew(R_X t_B)]` for X, move with the turn a of A_i and
    the shift of t_B. Those of the rotation are derivatives of a logarithm: with the residual
    `r = a + R_A R_X b` they are `(1 - skew(r) / 2) R_A` for X and `-(1 + skew(r) / 2)` for Z, so
    they move with the turns a of A_i and b of B_i.

    Args:
        root: (N, 6, 6) lower roots of the residuals' covariances.
        A: (N, 4, 4) reference_T_mount.
        X: (4, 4) mount_T_camera.
        B: (N, 4, 4) camera_T_target.

    Returns:
        (N, 9, 6, 12) derivatives by the turn of A_i, the shift of B_i and the turn of B_i of the
        derivatives of the six residuals by X and Z.
    """
    R_A, R_X = A[:, None, :3, :3], X[:3, :3]
    lever = rotations.skew(B[:, None, :3, 3] @ R_X.T)
    turn_A = rotations.skew(np.eye(3))
    turn_B = rotations.skew(np.swapaxes(R_A[:, 0] @ R_X, -1, -2))
    moved = np.zeros((len(A), 9, 6, 12))
    moved[:, :3, :3, :3] = turn_A @ R_A
    moved[:, :3, :3, 3:6] = -turn_A @ R_A @ lever
    moved[:, 3:6, :3, 3:6] = -R_A @ rotations.skew(R_X.T)
    moved[:, :3, 3:, 3:6] = 0.5 * turn_A @ R_A
    moved[:, 6:, 3:, 3:6] = -0.5 * turn_B @ R_A
    moved[:, :3, 3:, 9:] = -0.5 * turn_A
    moved[:, 6:, 3:, 9:] = -0.5 * turn_B
    return np.asarray(np.linalg.solve(root[:, None], moved))


def feigned_information(
    moved: FloatArray, constant: FloatArray, covariance: FloatArray
) -> FloatArray:
    """Return the information that noise alone is expected to show.

    Args:
        moved: (N, 9, 6, q) derivatives of q whitened columns by the errors of the stations' poses.
        constant: (6 N, 6) orthonormal basis of what Z takes up, which is left out.
        covariance: (N, 12, 12) of those errors.

    Returns:
        (q, q), on the directions of the columns.
    """
    share = constant.reshape(-1, 6, 6)
    left = np.eye(6) - share @ np.swapaxes(share, -1, -2)
    mixed = np.einsum("nab,nbij->naij", covariance[:, 3:, 3:], left[:, None] @ moved)
    return np.asarray(np.einsum("naki,nakj->ij", moved, mixed))
