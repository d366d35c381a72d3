"""The hypothesis that the target's lengths are wrong, beside that of a target that was moved.

Stations at one distance, and then at another, see a target of a wrong size in two places: a move
explains them, and one wrong length does so with far fewer unknowns.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handeye_cli.diagnosis.robust_fit import Agreement, best_agreement, cost
from handeye_cli.geometry.block_loop import BlockLoops
from handeye_cli.geometry.motion_invariants import fit_rotations, fit_translations
from handeye_cli.records import FloatArray

_OF_A_RATIO = 2.0
"""Cost of one more unknown, the ratio of lengths; a move of the target has six, and a place."""
_LARGEST_RATIO = 0.15
"""Natural logarithm of a ratio of lengths that is not refused before stations are looked at."""


def instead_of_move(
    split: Agreement, loops: BlockLoops, variances: FloatArray, *, hidden: bool
) -> Agreement | None:
    """Return the agreement on one place of a target of another size, if that is as likely.

    Args:
        split: The agreement on two places of a target of the declared size.
        loops: All stations, with one block.
        variances: (K,) rough variances of the noise to start from.
        hidden: Whether there are signs of bad stations that nobody stands out as.

    Returns:
        The agreement, or None where the move is likelier, or where the lengths that fit best are
        not near the declared ones: that is another verdict, or what the stations leave open.
    """
    ratio = _ratio(loops)
    if abs(np.log(ratio)) > _LARGEST_RATIO:
        return None
    stretched = loops.B.copy()
    stretched[:, :3, 3] *= ratio
    other = best_agreement(replace(loops, B=stretched), variances, hidden=hidden)
    by_lengths = cost(other, other.outside) + _OF_A_RATIO
    return other if by_lengths <= cost(split, split.outside + 1) else None


def _ratio(loops: BlockLoops) -> float:
    """Return by what factor the camera's lengths have to be longer to fit best."""
    everybody = np.ones((1, len(loops.A)), dtype=bool)
    trusted = np.array([len(loops.A)])
    A, B = loops.A[None], loops.B[None]
    turned = fit_rotations(A[..., :3, :3], B[..., :3, :3], everybody, trusted)
    return float(fit_translations(A, B, turned, everybody, trusted).ratio[0])
