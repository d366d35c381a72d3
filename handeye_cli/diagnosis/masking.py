"""Bad stations that hide in the noise they make: signs of it that cost little.

A fit to all stations spreads the errors of a few over all, and the noise it shows is then so large
that nobody stands out. Subsets without bad stations still agree among themselves: pairs in their
rotation angles, which no answer is needed for, and triples in their translations. A good recording
shows in the smaller half of these as much noise as everywhere.
"""

from __future__ import annotations

import math

import numpy as np

from handeye_cli.diagnosis.robust_fit import Agreement
from handeye_cli.geometry import rotations, se3, statistics
from handeye_cli.geometry.block_loop import loop_covariances
from handeye_cli.geometry.subsets import subsets

_HIDDEN = 0.5
"""Noise among the best, over that of a good recording, below which something is hidden."""
_PAIRS = 0.3
"""Part of the pairs that are looked at: less than those without a bad third of the stations."""
_PAIRS_SIZE = 0.385
"""Size that this part of normal numbers stays below, in standard deviations."""
_TRIPLES = 0.15
"""Part of the triples; 0.2 to 0.3 of them are without a bad third of the stations."""
_TRIPLES_SQUARE = 0.798
"""Its quantile of chi-square with the three degrees of freedom of a triple's translations."""
_MOST = 300
"""Subsets that are looked at, at most."""
_CONTRASTS = np.array([[1.0, -1.0, 0.0], [1.0, 1.0, -2.0]]) / np.sqrt([[2.0], [6.0]])
"""Differences of three equally noisy things that are independent and as noisy as each."""
_PARALLEL = 1e-3
"""Ratio of sizes below which the axes of three stations leave a translation open."""


def hides(agreed: Agreement) -> bool:
    """Return whether small subsets agree far better than the fit to all stations says."""
    variances = np.einsum("nii->ni", loop_covariances(agreed.loops, agreed.found)).mean(axis=0)
    translation, rotation = np.sqrt(se3.by_kind(variances) / 3.0)
    seen = _angle_noise(agreed) / rotation, _translation_noise(agreed) / translation
    return bool(min(seen) < _HIDDEN)


def _angle_noise(agreed: Agreement) -> float:
    """Return the noise per axis that the rotation angles of the better pairs show, radians."""
    A, B = agreed.loops.A[:, :3, :3], agreed.loops.B[:, :3, :3]
    i, j = subsets(len(A), 2, _MOST).T
    robot = rotations.angle(np.swapaxes(A[i], -1, -2) @ A[j])
    camera = rotations.angle(B[i] @ np.swapaxes(B[j], -1, -2))
    size = statistics.quantile(np.abs(robot - camera), _PAIRS)
    return size / (_PAIRS_SIZE * math.sqrt(2.0))


def _translation_noise(agreed: Agreement) -> float:
    """Return the noise per axis that the translations of the better triples show, metres."""
    loops, found = agreed.loops, agreed.found
    triples = subsets(len(loops.A), 3, _MOST)
    seen = (loops.A @ found.X @ loops.B)[triples, :3, 3]
    apart = (_CONTRASTS @ seen).reshape(-1, 6, 1)
    rows = np.einsum("ct,mtij->mcij", _CONTRASTS, loops.A[triples, :3, :3]).reshape(-1, 6, 3)
    left = apart - rows @ (np.linalg.pinv(rows, rcond=_PARALLEL) @ apart)
    squares = np.sum(left**2, axis=(1, 2))
    return float(np.sqrt(statistics.quantile(squares, _TRIPLES) / _TRIPLES_SQUARE))
