"""A first answer that no minority of bad stations can spoil: the consensus of small subsets.

Three stations determine an answer by the paper's closed form. Many triples give many answers; the
best are refined by turns of fitting the stations that agree best and choosing these anew, and the
one whose stations agree most closely is taken (Rousseeuw and Van Driessen 1999). Rotations and
translations are measured on scales of their own, so that no noise level has to be known.
"""

from __future__ import annotations

import numpy as np

from handeye_cli.geometry import se3
from handeye_cli.geometry.block_loop import BlockLoops, BoolArray, linearised, moved
from handeye_cli.geometry.scaled_inverse import scaled_pseudo_inverse
from handeye_cli.geometry.star import all_pairs
from handeye_cli.geometry.subsets import subsets
from handeye_cli.records import FloatArray, IntArray
from handeye_cli.solvers import tsai_lenz
from handeye_cli.solvers.problem import Problem

_MOST_TRIPLES = 100
"""With half of the stations bad, all of so many triples are spoilt once in 6e5 recordings."""
_REFINED = 8
_ROUNDS = 3
_INSIDE = 3.0
"""Stations agree when they are within this factor of how far the nearest ones are apart."""
_DETERMINED = 1e-4
"""Part of the best determined direction's information that a direction needs to be fitted."""
_FLOOR = 1e-18
"""Smallest mean square that scales are compared at, rad^2 and m^2."""


def consensus(loops: BlockLoops, size: int) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return an answer that `size` of the stations agree on closely, and all that do.

    Args:
        loops: The stations; their noise is not used.
        size: How many have to agree.

    Returns:
        (4, 4) X, (b, 4, 4) Z and (N,) which stations agree.
    """
    X, Z = _hypotheses(loops)
    closed = se3.difference(loops.A @ X[:, None] @ loops.B, Z[:, loops.blocks])
    best = np.argsort(_disagreement(_squares(closed), size), kind="stable")[:_REFINED]
    X, Z = _refined(loops, X[best], Z[best], size)
    squares = _squares(linearised(loops, X, Z).residuals)
    winner = int(np.argmin(_disagreement(squares, size)))
    near, scale = _nearest(squares[[winner]], size)
    inside = np.all(squares[winner] < _INSIDE**2 * (scale + _FLOOR), axis=-1)
    inside[near] = True
    return X[winner], Z[winner], inside


def _refined(
    loops: BlockLoops, X: FloatArray, Z: FloatArray, size: int
) -> tuple[FloatArray, FloatArray]:
    """Fit the nearest stations and choose them anew, by turns."""
    for _ in range(_ROUNDS):
        linear = linearised(loops, X, Z)
        near, scale = _nearest(_squares(linear.residuals), size)
        J = np.take_along_axis(linear.design, near[..., None, None], axis=1)
        r = np.take_along_axis(linear.residuals, near[..., None], axis=1)
        weight = np.repeat(1.0 / np.sqrt(scale + _FLOOR), 3, axis=-1)[:, None]
        X, Z = moved(X, Z, _step(weight[..., None] * J, weight * r))
    return X, Z


def _step(J: FloatArray, r: FloatArray) -> FloatArray:
    """Return the (H, p) least-squares steps; what is hardly determined stays as it is."""
    information = np.swapaxes(J, -1, -2) @ J
    information = information.sum(axis=1)
    gradient = np.einsum("hnij,hni->hj", J, r)
    inverse = scaled_pseudo_inverse(information, _DETERMINED)
    return np.asarray(-(inverse @ gradient[..., None])[..., 0])


def _hypotheses(loops: BlockLoops) -> tuple[FloatArray, FloatArray]:
    """Return (H, 4, 4) X by triples of one block, and (H, b, 4, 4) Z by one station of each."""
    triples = _triples(loops.blocks)
    problem = Problem(loops.A[triples], loops.B[triples], all_pairs(3), np.zeros((3, 12, 12)))
    X = tsai_lenz.solve(problem).X
    seen = _one_of_each(loops.blocks, triples)
    return X, loops.A[seen] @ X[:, None] @ loops.B[seen]


def _triples(blocks: IntArray) -> IntArray:
    """Return (H, 3) stations of one block."""
    count = int(blocks.max()) + 1
    members = [np.flatnonzero(blocks == block) for block in range(count)]
    return np.concatenate(
        [one[subsets(len(one), 3, _MOST_TRIPLES // count)] for one in members if len(one) >= 3]
    )


def _one_of_each(blocks: IntArray, triples: IntArray) -> IntArray:
    """Return (H, b): a station of each block, the triple's first for its own."""
    count = int(blocks.max()) + 1
    members = [np.flatnonzero(blocks == block) for block in range(count)]
    turn = np.arange(len(triples))
    drawn = np.stack([one[turn % len(one)] for one in members], axis=1)
    drawn[turn, blocks[triples[:, 0]]] = triples[:, 0]
    return drawn


def _squares(residuals: FloatArray) -> FloatArray:
    """Return the (H, N, 2) squared distances and angles."""
    return se3.by_kind(residuals**2)


def _nearest(squares: FloatArray, size: int) -> tuple[IntArray, FloatArray]:
    """Return the (H, size) stations nearest to each answer, and their (H, 2) mean squares."""
    middle = np.sort(squares, axis=1)[:, squares.shape[1] // 2, None] + _FLOOR
    near = np.argsort(np.sum(squares / middle, axis=-1), axis=1, kind="stable")[:, :size]
    return near, np.mean(np.take_along_axis(squares, near[..., None], axis=1), axis=1)


def _disagreement(squares: FloatArray, size: int) -> FloatArray:
    """Return the (H,) misfits of all stations, in units of the scatter of the nearest.

    Stations far away count little (Cauchy's function), but they count: stations in nearly one place
    agree on any answer.
    """
    _, scale = _nearest(squares, size)
    smallest = scale[np.argmin(np.sum(np.log(scale + _FLOOR), axis=1))] + _FLOOR
    return np.asarray(np.sum(np.log1p(np.sum(squares / smallest, axis=-1)), axis=1))
