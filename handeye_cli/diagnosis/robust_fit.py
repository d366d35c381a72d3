"""Which stations agree on one answer: grown from a consensus, judged by predicting the others.

Stations are added to those that agree in the order of their distance (forward search; Atkinson and
Riani 2000), and the noise is estimated anew from those inside, so its scale follows the data and
never the bad ones. When the nearest of those outside is too far away to be chance, all outside are
bad; each of them, and none of those inside, contradicts a fit to all good stations but itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from handeye_cli.geometry.block_loop import (
    BlockFit,
    BlockLoops,
    BoolArray,
    Distances,
    fit,
    loop_covariances,
    predicted,
)
from handeye_cli.geometry.tail_probabilities import trimmed_variance
from handeye_cli.records import FloatArray
from handeye_cli.records.bad_stations import most_bad

SIGNIFICANCE = 0.005
"""Chance that one station of a good recording is called bad."""
MOST_FREEDOM = 12.0
"""Errors of real recordings have longer tails than the normal distribution: about Student's."""
_GROWTH = 8
"""An eighth of the stations inside is added at a time."""
_POOL = 100
"""Stations the search starts with; all others are judged by what it finds."""
_ROUNDS = 10
_FEWEST_FOR_HALF = 7
"""Stations of which a half is enough to agree on something."""


@dataclass(frozen=True)
class Agreement:
    """The stations that agree, and how far all are from what they say.

    Attributes:
        loops: All N stations.
        rows: (N,) which ones agree.
        found: The fit to these.
        distances: Of all stations; those that agree are compared with a fit that has seen them.
    """

    loops: BlockLoops
    rows: BoolArray
    found: BlockFit
    distances: Distances

    @property
    def outside(self) -> int:
        """How many stations do not agree."""
        return int(np.count_nonzero(~self.rows))


def ordinary(loops: BlockLoops, start: BlockFit) -> Agreement:
    """Fit all stations.

    Args:
        loops: The stations.
        start: A first answer.
    """
    everybody = np.ones(len(loops.A), dtype=bool)
    found, distances = fit(loops, everybody, start)
    return Agreement(loops, everybody, found, distances)


def best_agreement(loops: BlockLoops, variances: FloatArray, *, hidden: bool) -> Agreement:
    """Find the stations that agree on one answer, so that as little as possible contradicts it.

    The search starts from the best two thirds, which few stations that agree on something else by
    the symmetry of a layout cannot outdo; where that may not be enough, from the best half too.

    Args:
        loops: The stations, four or more, with one block.
        variances: (K,) rough variances of the noise to start from.
        hidden: Whether there are signs of bad stations that nobody stands out as.
    """
    count = len(loops.A)
    first = agreeing(loops, variances, count - most_bad(count))
    enough = first.outside <= most_bad(count) and not hidden
    if enough or count < _FEWEST_FOR_HALF:
        return first
    second = agreeing(loops, variances, (count + 1) // 2)
    return min(first, second, key=lambda agreed: cost(agreed, agreed.outside))


def cost(agreed: Agreement, faults: int) -> float:
    """Return how unlikely the stations are, as twice the negative logarithm, and the faults too.

    Every fault explains six numbers by six unknowns. Unknowns are counted as Hurvich and Tsai
    (1989) do for small samples, where a perfect fit is nothing rare; a fault may be anywhere.
    """
    count = len(agreed.rows)
    S = loop_covariances(agreed.loops, agreed.found)
    r = agreed.distances.residuals[agreed.rows]
    squares = np.sum(r * np.linalg.solve(S[agreed.rows], r[..., None])[..., 0])
    numbers, unknowns = 6 * count, 12 + 6 * faults
    counted = 2.0 * unknowns * numbers / max(numbers - unknowns - 1, 1)
    return float(np.sum(np.linalg.slogdet(S)[1]) + squares) + counted + 2 * faults * math.log(count)


def largest_contradiction(agreed: Agreement) -> tuple[int, float]:
    """Return the station inside that the others inside contradict most, and the chance of it."""
    inside = np.where(agreed.rows, agreed.distances.squares, -1.0)
    worst = int(np.argmax(inside))
    others = agreed.rows.copy()
    others[worst] = False
    _, distances = fit(agreed.loops, others, agreed.found)
    return worst, float(distances.chances(MOST_FREEDOM)[worst])


def agreeing(loops: BlockLoops, variances: FloatArray, size: int) -> Agreement:
    """Find the stations that agree on one answer, of which there must be at least `size`.

    Args:
        loops: The stations, four or more.
        variances: (K,) rough variances of the noise to start from.
        size: How many stations the search starts with.
    """
    from handeye_cli.diagnosis.robust_start import consensus

    pool = np.linspace(0, len(loops.A) - 1, min(len(loops.A), _POOL)).astype(int)
    chosen = loops.part(pool)
    X, Z, rows = consensus(chosen, -(-size * len(pool) // len(loops.A)))
    unknown = 6 + 6 * len(Z)
    nothing = np.zeros((unknown, unknown))
    start = BlockFit(X, Z, variances, np.zeros((0, 0)), nothing, np.zeros((0, *nothing.shape)))
    grown = _grown(chosen, rows, start)
    if len(pool) < len(loops.A):
        distances = predicted(loops, grown.found)
        rows = distances.chances(MOST_FREEDOM) > level(loops)
        grown = Agreement(loops, rows, grown.found, distances)
    return _settled(grown)


def level(loops: BlockLoops) -> float:
    """Return the chance below which one of many stations is called bad."""
    return SIGNIFICANCE / len(loops.A)


def _grown(loops: BlockLoops, rows: BoolArray, start: BlockFit) -> Agreement:
    """Add stations to those that agree until the nearest of the others is too far away."""
    count = len(rows)
    found, distances = fit(loops, rows, start, steps=2)
    while not rows.all():
        inside = int(np.count_nonzero(rows))
        trimmed = trimmed_variance(inside / count, 6)
        honest = replace(distances, squares=distances.squares * trimmed)
        possible = rows | (honest.chances(MOST_FREEDOM) > level(loops))
        more = min(inside + max(inside // _GROWTH, 1), int(np.count_nonzero(possible)))
        if more == inside:
            break
        order = np.argsort(np.where(possible, distances.squares, np.inf), kind="stable")
        rows = np.zeros(count, dtype=bool)
        rows[order[:more]] = True
        found, distances = fit(loops, rows, found)
    return Agreement(loops, rows, found, distances)


def _settled(agreed: Agreement) -> Agreement:
    """Exchange stations until none outside agrees and none inside contradicts.

    No station is called bad by less than half of them.
    """
    fewest = (len(agreed.rows) + 1) // 2
    for _ in range(_ROUNDS):
        found, distances = fit(agreed.loops, agreed.rows, agreed.found, steps=2)
        agreed = replace(agreed, found=found, distances=distances)
        near = distances.chances(MOST_FREEDOM) > level(agreed.loops)
        rows = agreed.rows | near
        if np.array_equal(rows, agreed.rows):
            worst, chance = largest_contradiction(agreed)
            rows = agreed.rows.copy()
            rows[worst] = chance > level(agreed.loops)
            if rows[worst] or np.count_nonzero(rows) < fewest:
                break
        agreed = replace(agreed, rows=rows)
    return agreed
