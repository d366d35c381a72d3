"""Loops of stations that see one of several targets, `A_i X B_i = Z_b(i)`: fit and prediction.

Each of the Z is one block of stations between which the target stood still. Stations that take no
part in a fit are predicted by it; those that do are compared with what the fit would say without
them, at the same noise. Their squared distances are weighted with the covariance of exactly that
difference, so a station that alone holds up a direction of the answer is not judged along it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from handeye_cli.geometry import se3, variance
from handeye_cli.geometry.loop import LoopJacobians, loop_jacobians
from handeye_cli.geometry.scaled_inverse import scaled_pseudo_inverse
from handeye_cli.geometry.tail_probabilities import chance_of_squares

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_RIDGE = 1e-9
"""Information, relative to a direction's own, that makes undetermined directions very uncertain."""
_LEVERAGE = 1e-6
"""Part of a station's variance that its own pull on the fit always leaves it."""
_SMALLEST = 1e-4
"""Part of what would explain the residuals that a variance is at least; less cannot be told."""
_TINIEST = 1e-18
"""Smallest variance that would explain anything, rad^2 and m^2."""
_NOISE_FROM = 400
"""Stations the noise is estimated from, at most: enough for its size to 2 %."""


@dataclass(frozen=True)
class BlockLoops:
    """Stations and what is known of their noise.

    Attributes:
        A: (N, 4, 4) reference_T_mount.
        B: (N, 4, 4) camera_T_target.
        known: (N, 12, 12) known covariance of the perturbations of A_i and B_i.
        shapes: (K, N, 12, 12) what each unknown variance adds to it.
        blocks: (N,) which target each station sees, from 0 on.
    """

    A: FloatArray
    B: FloatArray
    known: FloatArray
    shapes: FloatArray
    blocks: IntArray

    def part(self, rows: IntArray) -> BlockLoops:
        """Return some of the stations."""
        return replace(
            self,
            A=self.A[rows],
            B=self.B[rows],
            known=self.known[rows],
            shapes=self.shapes[:, rows],
            blocks=self.blocks[rows],
        )

    def paired(self, robot: IntArray, camera: IntArray) -> BlockLoops:
        """Return stations made of one station's robot pose and another one's image."""
        joined = replace(self.part(camera), A=self.A[robot])
        known, shapes = joined.known.copy(), joined.shapes.copy()
        known[:, :6, :6], shapes[:, :, :6, :6] = (
            self.known[robot, :6, :6],
            self.shapes[:, robot, :6, :6],
        )
        return replace(joined, known=known, shapes=shapes)


@dataclass(frozen=True)
class BlockFit:
    """The answer of some stations, and how sure it and the noise are.

    Attributes:
        X: (4, 4) mount_T_camera.
        Z: (b, 4, 4) reference_T_target of each block.
        variances: (K,) of the noise.
        spread: (K, K) covariance of these estimates.
        covariance: (6 + 6 b, 6 + 6 b) of X and the Z.
        slopes: (K, 6 + 6 b, 6 + 6 b) its derivative by the variances.
    """

    X: FloatArray
    Z: FloatArray
    variances: FloatArray
    spread: FloatArray
    covariance: FloatArray
    slopes: FloatArray


@dataclass(frozen=True)
class Distances:
    """How far stations are from a fit.

    Attributes:
        residuals: (N, 6) of the loops.
        squares: (N,) of six residuals, weighted with the covariance of their prediction.
        freedom: (N,) degrees of freedom of that covariance's scale; infinite when it is known.
    """

    residuals: FloatArray
    squares: FloatArray
    freedom: FloatArray

    def chances(self, most_freedom: float = np.inf) -> FloatArray:
        """Return the (N,) probabilities of distances as large as these, if all is well."""
        return chance_of_squares(self.squares, 6, np.minimum(self.freedom, most_freedom))


class _Linear(NamedTuple):
    """Residuals (..., N, 6), design (..., N, 6, 6 + 6 b) and derivatives by poses (..., 6, 12)."""

    residuals: FloatArray
    design: FloatArray
    by_poses: FloatArray

    def carried(self, covariance: FloatArray) -> FloatArray:
        """Return the covariances of the residuals that those of the poses cause."""
        return np.asarray(self.by_poses @ covariance @ np.swapaxes(self.by_poses, -1, -2))


def linearised(loops: BlockLoops, X: FloatArray, Z: FloatArray) -> _Linear:
    """Linearise the loops at (..., 4, 4) poses X and (..., b, 4, 4) poses Z."""
    found: LoopJacobians = loop_jacobians(
        loops.A[:, None], loops.B[:, None], X[..., None, :, :], Z[..., loops.blocks, :, :]
    )
    own = found.by_unknowns[..., 0, :, :]
    count = Z.shape[-3]
    design = np.zeros((*own.shape[:-1], 6 + 6 * count))
    design[..., :6] = own[..., :6]
    for block in range(count):
        seen = (loops.blocks == block)[:, None, None]
        design[..., 6 + 6 * block : 12 + 6 * block] = seen * own[..., 6:]
    return _Linear(found.residuals[..., 0, :], design, found.by_poses[..., 0, :, :])


def moved(X: FloatArray, Z: FloatArray, step: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return X and the Z after a (..., 6 + 6 b) step."""
    by_block = step[..., 6:].reshape(*step.shape[:-1], -1, 6)
    return se3.perturb(X, step[..., :6]), se3.perturb(Z, by_block)


def damped_inverse(information: FloatArray) -> FloatArray:
    """Return inverses in which undetermined directions are very uncertain instead of singular."""
    diagonal = np.einsum("...ii->...i", information)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    scaled = scale[..., :, None] * information * scale[..., None, :]
    inverse = np.linalg.inv(scaled + _RIDGE * np.eye(scaled.shape[-1]))
    return np.asarray(scale[..., :, None] * inverse * scale[..., None, :])


def fit(
    loops: BlockLoops, rows: BoolArray, start: BlockFit, *, steps: int = 1
) -> tuple[BlockFit, Distances]:
    """Fit X, the Z and the noise to some of the stations, and compare all with the answer.

    Args:
        loops: All stations.
        rows: (N,) which ones to fit.
        start: Where to linearise, and the variances to start from.
        steps: Gauss-Newton steps.

    Returns:
        The fit and the distances, both linearised before the last step.
    """
    found = start
    for _ in range(steps):
        linear = linearised(loops, found.X, found.Z)
        known, shapes = linear.carried(loops.known), linear.carried(loops.shapes)
        chosen = _some(rows)
        variances, spread = _noise(
            linear.residuals[chosen],
            linear.design[chosen],
            known[chosen],
            shapes[:, chosen],
            found.variances,
        )
        S = known + np.tensordot(variances, shapes, axes=1)
        step, covariance, slopes = _step(linear, S, shapes, rows)
        X, Z = moved(found.X, found.Z, step)
        found = BlockFit(X, Z, variances, spread, covariance, slopes)
    residuals = linear.residuals + linear.design @ step
    return found, _distances(linear, residuals, S, shapes, found=found, rows=rows)


def loop_covariances(loops: BlockLoops, found: BlockFit) -> FloatArray:
    """Return the (N, 6, 6) covariances that the noise of a fit gives the loops' residuals."""
    linear = linearised(loops, found.X, found.Z)
    covariance = loops.known + np.tensordot(found.variances, loops.shapes, axes=1)
    return linear.carried(covariance)


def predicted(loops: BlockLoops, found: BlockFit) -> Distances:
    """Compare stations that took no part in a fit with what it predicts for them."""
    linear = linearised(loops, found.X, found.Z)
    shapes = linear.carried(loops.shapes)
    S = linear.carried(loops.known) + np.tensordot(found.variances, shapes, axes=1)
    nobody = np.zeros(len(S), dtype=bool)
    return _distances(linear, linear.residuals, S, shapes, found=found, rows=nobody)


def _some(rows: BoolArray) -> IntArray:
    """Return the stations that the noise is estimated from."""
    chosen = np.flatnonzero(rows)
    if len(chosen) <= _NOISE_FROM:
        return chosen
    return np.asarray(chosen[np.linspace(0, len(chosen) - 1, _NOISE_FROM).astype(int)])


def _noise(
    residuals: FloatArray,
    design: FloatArray,
    known: FloatArray,
    shapes: FloatArray,
    start: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return the variances that the residuals of some stations show, and their covariance."""
    if not len(shapes):
        return np.zeros(0), np.zeros((0, 0))
    floor = _SMALLEST * sufficient_variances(residuals, shapes)
    found = variance.estimate(
        residuals=residuals, design=design, known=known, shapes=shapes, start=start, floor=floor
    )
    return found.variances, _spread(found.information, found.variances)


def _spread(information: FloatArray, variances: FloatArray) -> FloatArray:
    """Return the covariance of variances, or that of single squares where rounding hides it."""
    diagonal = np.diag(information)
    if not np.all(np.isfinite(diagonal) & (diagonal > 0.0)):
        return np.diag(2.0 * variances**2)
    return scaled_pseudo_inverse(information)


def sufficient_variances(residuals: FloatArray, shapes: FloatArray) -> FloatArray:
    """Return the (K,) variances each of which alone would explain rotations or translations.

    Args:
        residuals: (n, 6) of the loops.
        shapes: (K, n, 6, 6) what each variance adds to their covariance.
    """
    seen = se3.by_kind(np.mean(residuals**2, axis=0))
    added = se3.by_kind(np.mean(np.einsum("knii->kni", shapes), axis=1))
    alone = np.where(added > 0.0, seen / np.where(added > 0.0, added, 1.0), np.inf)
    return np.asarray(np.maximum(np.min(alone, axis=1), _TINIEST))


def _step(
    linear: _Linear, S: FloatArray, shapes: FloatArray, rows: BoolArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the Gauss-Newton step, its covariance and the slopes of that."""
    J, r = linear.design[rows], linear.residuals[rows]
    WJ = np.linalg.solve(S[rows], J)
    covariance = damped_inverse(np.einsum("nij,nik->jk", J, WJ))
    step = -covariance @ np.einsum("nij,ni->j", WJ, r)
    by_variance = np.sum(np.swapaxes(WJ, -1, -2) @ shapes[:, rows] @ WJ, axis=1)
    return step, covariance, covariance @ by_variance @ covariance


def _distances(
    linear: _Linear,
    residuals: FloatArray,
    S: FloatArray,
    shapes: FloatArray,
    *,
    found: BlockFit,
    rows: BoolArray,
) -> Distances:
    J, J_t = linear.design, np.swapaxes(linear.design, -1, -2)
    common = J @ found.covariance @ J_t
    own = (1.0 + _LEVERAGE) * S + np.where(rows, -1.0, 1.0)[:, None, None] * common
    weighted = np.linalg.solve(own, residuals[..., None])[..., 0]
    squares = np.maximum(np.sum(residuals * weighted, axis=-1), 0.0)
    shares = np.linalg.solve(S + common, shapes + J @ found.slopes[:, None] @ J_t)
    spread = np.tensordot(found.spread, shares, axes=1)
    excess = np.einsum("knij,knji->n", spread, shares) / 6.0
    freedom = np.maximum(2.0 / np.maximum(excess, 1e-300), 1.0)
    return Distances(residuals, squares, np.where(excess > 0.0, freedom, np.inf))
