"""A target that was moved once: from some station on all see it in another place.

A second pose of the target for all stations from k on costs six unknowns, as much as calling one
station bad. It is believed when the two poses differ significantly and this explains the stations
better than bad ones alone: with fewer faults, or with much less noise.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handeye_cli.diagnosis.robust_fit import (
    MOST_FREEDOM,
    SIGNIFICANCE,
    Agreement,
    agreeing,
    cost,
    level,
)
from handeye_cli.geometry import se3
from handeye_cli.geometry.block_loop import (
    BlockFit,
    BoolArray,
    damped_inverse,
    fit,
    linearised,
    loop_covariances,
)
from handeye_cli.geometry.tail_probabilities import chance_of_squares
from handeye_cli.records import FloatArray, IntArray
from handeye_cli.records.bad_stations import TargetMove, most_bad

_FEWEST = 6
"""Stations of which a move can be told from bad ones."""
_SIDE = 2
"""Stations on either side of a move, at least; a single one is a bad station."""
_MOST_PLACES = 2
"""Places of a move that are tried by fitting two poses."""
_MOST_ALIKE = 0.9
"""Correlation of stations after each other, at most; more is a constant."""
_AS_LIKELY = 0.8
"""Part of the largest score of a move from which another place is tried as well."""


def likeliest_move(agreed: Agreement) -> tuple[int, float]:
    """Return where a fit with one pose would most like to have two, and the chance of that.

    Args:
        agreed: A fit of one block.

    Returns:
        The last station before the move, and the chance of as clear a move anywhere among as many
        stations if the target stood still; 1 where there are too few to tell.
    """
    count = len(agreed.rows)
    if count < _FEWEST:
        return 0, 1.0
    squares = _step_squares(agreed)[_SIDE - 1 : -_SIDE + 1]
    order = np.argsort(-squares, kind="stable")[:_MOST_PLACES]
    places = order[squares[order] >= _AS_LIKELY * squares[order[0]]] + _SIDE - 1
    tried = [(_moved_fit_chance(agreed, int(place)), int(place)) for place in places]
    chance, place = min(tried)
    return place, min(count * chance, 1.0)


def _moved_fit_chance(agreed: Agreement, place: int) -> float:
    """Return the chance of the move between two poses fitted to the same stations."""
    loops = replace(agreed.loops, blocks=_blocks(len(agreed.rows), place))
    start = replace(agreed.found, Z=agreed.found.Z[[0, 0]])
    return _move_chance(fit(loops, agreed.rows, start)[0])


def _blocks(count: int, place: int) -> IntArray:
    return (np.arange(count) > place).astype(np.int64)


def _step_squares(agreed: Agreement) -> FloatArray:
    """Return the (N - 1,) squares of score tests for a second pose after each station."""
    linear = linearised(agreed.loops, agreed.found.X, agreed.found.Z)
    S = loop_covariances(agreed.loops, agreed.found)
    J, D = linear.design, linear.design[..., 6:]
    weighted = np.swapaxes(np.linalg.solve(S, D * agreed.rows[:, None, None]), -1, -2)
    score = _after((weighted @ linear.residuals[..., None])[..., 0])
    common, own = _after(weighted @ J), _after(weighted @ D)
    own = own - common @ agreed.found.covariance @ np.swapaxes(common, -1, -2)
    squares = np.einsum("ki,kij,kj->k", score, damped_inverse(own), score)
    return np.asarray(np.maximum(squares, 0.0))


def _after(values: FloatArray) -> FloatArray:
    """Return the sums over all stations after each but the last."""
    return np.asarray(np.cumsum(values[::-1], axis=0)[::-1][1:])


def split_agreement(best: Agreement, faults: int) -> Agreement | None:
    """Return the agreement on two poses of the target, where that explains more than one pose.

    Args:
        best: The largest agreement on one pose.
        faults: How many things must have gone wrong with one pose: as many as stations contradict,
            or fewer where these are exchanged with one another.
    """
    if len(best.rows) < _FEWEST:
        return None
    place, chance = likeliest_move(best)
    places = {place} if chance < SIGNIFICANCE else set()
    if best.outside >= _SIDE:
        places.add(_boundary(~best.rows))
    found = [_agreement_of_two(best, each) for each in sorted(places)]
    costs = [(cost(split, split.outside + 1), split) for split in found if split]
    least, split = min(costs, key=lambda pair: pair[0], default=(np.inf, best))
    return split if least < cost(best, faults) else None


def _boundary(bad: BoolArray) -> int:
    """Return the place that separates good stations from bad ones best, in either order."""
    before = np.cumsum(np.where(bad, 1, -1))
    return int(np.argmax(np.abs(2 * before - before[-1])[_SIDE - 1 : -_SIDE])) + _SIDE - 1


def _agreement_of_two(best: Agreement, place: int) -> Agreement | None:
    """Return the agreement on two poses, if few contradict, and the poses differ significantly."""
    count = len(best.rows)
    loops = replace(best.loops, blocks=_blocks(count, place))
    split = agreeing(loops, best.found.variances, count - most_bad(count))
    few = split.outside <= most_bad(count)
    seen = np.bincount(loops.blocks[split.rows], minlength=2)
    clear = _move_chance(split.found) < level(loops)
    return split if few and clear and min(seen) >= _SIDE else None


def _move_squares(found: BlockFit) -> tuple[float, float]:
    """Return the squares of the difference of two poses and the freedom of their scale."""
    difference = np.concatenate([np.zeros((6, 6)), -np.eye(6), np.eye(6)], axis=1)
    covariance = difference @ found.covariance @ difference.T
    step = se3.difference(found.Z[1], found.Z[0])
    shares = np.linalg.solve(covariance, difference @ found.slopes @ difference.T)
    excess = float(np.einsum("kl,kij,lji->", found.spread, shares, shares)) / 6.0
    freedom = max(2.0 / excess, 1.0) if excess > 0.0 else np.inf
    return float(step @ np.linalg.solve(covariance, step)), freedom


def _move_chance(found: BlockFit) -> float:
    squares, freedom = _move_squares(found)
    return float(chance_of_squares(squares, 6, min(freedom, MOST_FREEDOM)))


def stands_out(split: Agreement) -> bool:
    """Return whether a move is clear where the errors of stations after each other are alike.

    So they are along a robot's way: the mean of many is no better than that of the few that are
    independent (Bartlett 1935), by the correlation of each with the next.

    Args:
        split: The agreement on two poses, of stations in the order of their times.
    """
    squares, freedom = _move_squares(split.found)
    likeness = _likeness_of_next(split)
    fewer = (1.0 - likeness) / (1.0 + likeness)
    chance = chance_of_squares(squares * fewer, 6, min(freedom * fewer, MOST_FREEDOM))
    return float(chance) < level(split.loops)


def _likeness_of_next(split: Agreement) -> float:
    """Return the correlation, 0 or more, of whitened residuals with those of the next station."""
    rows = np.flatnonzero(split.rows)
    root = np.linalg.cholesky(loop_covariances(split.loops, split.found)[rows])
    white = np.linalg.solve(root, split.distances.residuals[rows][..., None])[..., 0]
    following = np.diff(split.loops.blocks[rows]) == 0
    products = float(np.mean(np.sum(white[1:] * white[:-1], axis=-1)[following]))
    squares = float(np.mean(np.sum(white**2, axis=-1)))
    return float(np.clip(products / max(squares, np.finfo(float).tiny), 0.0, _MOST_ALIKE))


def move_of(split: Agreement) -> TargetMove:
    """Describe the move between the two poses of an agreement."""
    blocks, first, second = split.loops.blocks, split.found.Z[0], split.found.Z[1]
    step = se3.difference(second, first)
    agreeing_rows: IntArray = np.flatnonzero(split.rows)
    seen = blocks[agreeing_rows]
    smaller = int(np.count_nonzero(seen == 1) <= np.count_nonzero(seen == 0))
    return TargetMove(
        before=int(agreeing_rows[seen == 0][-1]),
        after=int(agreeing_rows[seen == 1][0]),
        rotation=float(np.linalg.norm(step[3:])),
        translation=float(np.linalg.norm(step[:3])),
        sigmas=float(np.sqrt(_move_squares(split.found)[0])),
        rows=tuple(agreeing_rows[seen == smaller].tolist()),
    )
