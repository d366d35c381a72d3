"""How well hypotheses fit, and which of them the data speak for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handeye_cli.diagnosis.hypotheses import Hypothesis
from handeye_cli.geometry import statistics
from handeye_cli.geometry.motion_invariants import fit_rotations, fit_translations, second_turn
from handeye_cli.records import FloatArray, IntArray

_AT_ONCE = 64
"""Hypotheses that are fitted together; more would cost memory and save no time."""
_FINEST_TURN = 1e-4
"""Radians below which the residual of a rotation is as good as none."""
_FINEST_SHARE = 1e-4
"""Share of the motions' lengths below which the residual of a translation is as good as none."""
_LARGEST_TURN = 0.06
"""Residual in radians that noise explains, RMS: poses are rarely worse than 10 mrad."""
_LARGEST_SHARE = 0.25
"""The same of a translation, as a share of the motions' lengths."""
_LEAST_FACTOR = 3.0
"""An alternative has to fit better by this factor however many stations there are."""
_CONFIDENCE = 6.0
"""The factor's logarithm in standard deviations: there are many hypotheses, and not all errors are
noise."""
_NO_WORSE = 0.75
"""Factor to which the other residual of an alternative has to keep what the declared one has."""
_AS_GOOD = 2.0
"""Residuals within this factor of the best ones are as good."""
_EXPLAINED = 4.0
"""Residuals up to this multiple of the RMS are those of a station that agrees."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A hypothesis and how well it fits.

    Attributes:
        hypothesis: The reading of the numbers.
        rotation: RMS residual of the stations that agree best, radians.
        translation: The same of the translations, with the lengths in the ratio that fits best and
            half-way between those of robot and camera.
        apart: The same with the lengths as they are, metres.
        ratio: Lengths of the robot over those of the camera.
        correlation: Between what both sides say about the ratio.
        reach: RMS length of the motions that the translations have to match.
        turns: How far the camera turns across its main axis, RMS, radians.
        t_X: (3,) translation of mount_T_camera with the lengths as they are.
        t_Z: (3,) that of reference_T_target.
        by_camera: (3,) part of t_X that grows with the camera's lengths.
        trusted: Number of stations in the RMS.
        residuals: (2, N) of each station in rotation and translation; infinite without part.
    """

    hypothesis: Hypothesis
    rotation: float
    translation: float
    apart: float
    ratio: float
    correlation: float
    reach: float
    turns: float
    t_X: FloatArray
    t_Z: FloatArray
    by_camera: FloatArray
    trusted: int
    residuals: FloatArray

    @property
    def score(self) -> float:
        """Logarithm of the product of both residuals, what is too small to matter cut off."""
        return math.log(self.least_rotation) + math.log(self.least_translation)

    @property
    def least_rotation(self) -> float:
        """The residual of the rotations that counts, radians."""
        return max(self.rotation, _FINEST_TURN)

    @property
    def least_translation(self) -> float:
        """The residual of the translations that counts, metres."""
        return max(self.translation, _FINEST_SHARE * self.reach, 1e-9)

    @property
    def matched(self) -> float:
        """The RMS residual of the translations in lengths of the camera, metres."""
        return self.translation / math.sqrt(self.ratio)

    @property
    def freedom(self) -> int:
        """Degrees of freedom of either residual."""
        return max(3 * self.trusted - 6 - self.hypothesis.more_unknowns, 1)

    @property
    def left_out(self) -> int:
        """Number of stations that do not agree or take no part."""
        levels = np.array([self.least_rotation, self.least_translation])
        return int(np.sum(np.any(self.residuals > _EXPLAINED * levels[:, None], axis=0)))

    @property
    def typical(self) -> FloatArray:
        """(2,) medians over all stations of the residuals in rotation and translation."""
        there = self.residuals[:, self.hypothesis.mask]
        return np.array([statistics.median(each) for each in there])

    @property
    def like_noise(self) -> bool:
        """Whether noise explains what is left."""
        return self.rotation <= _LARGEST_TURN and self.translation <= _LARGEST_SHARE * self.reach


def fit(hypotheses: Sequence[Hypothesis], trusted: int | None = None) -> list[Fit]:
    """Fit hypotheses of the same stations.

    Args:
        hypotheses: Readings of N stations.
        trusted: Stations of each that are trusted to agree; by their number when None.
    """
    parts = [hypotheses[k : k + _AT_ONCE] for k in range(0, len(hypotheses), _AT_ONCE)]
    return [each for part in parts for each in _fit_together(part, trusted)]


def _fit_together(hypotheses: Sequence[Hypothesis], most: int | None) -> list[Fit]:
    A = np.stack([each.A for each in hypotheses])
    B = np.stack([each.B for each in hypotheses])
    mask = np.stack([each.mask for each in hypotheses])
    count = np.sum(mask, axis=-1)
    trusted = _trusted(count) if most is None else np.minimum(count, most)
    turned = fit_rotations(A[..., :3, :3], B[..., :3, :3], mask, trusted)
    moved = fit_translations(A, B, turned, mask, trusted)
    turns = second_turn(B[..., :3, :3], turned.kept)
    return [
        Fit(
            hypothesis=hypothesis,
            rotation=float(turned.rms[row]),
            translation=float(moved.rms[row]),
            apart=float(moved.apart[row]),
            ratio=float(moved.ratio[row]),
            correlation=float(moved.correlation[row]),
            reach=float(moved.reach[row]),
            turns=float(turns[row]),
            t_X=moved.t_X[row],
            t_Z=moved.t_Z[row],
            by_camera=moved.by_camera[row],
            trusted=int(trusted[row]),
            residuals=np.stack([turned.residuals[row], moved.residuals[row]]),
        )
        for row, hypothesis in enumerate(hypotheses)
    ]


def _trusted(count: IntArray) -> IntArray:
    """Return how many of some stations are trusted to agree: two may be bad, or a fifth of many.

    Of few stations fewer may be bad: what three or four are left to say, any reading satisfies.
    """
    return count - np.maximum(np.clip((count - 3) // 2, 0, 2), count // 5)


def clear_factor(first: Fit, second: Fit) -> float:
    """Return the factor between residuals of two fits that chance does not bring about.

    The logarithm of an RMS of f independent residuals scatters by 1 / sqrt(2 f).
    """
    freedom = min(first.freedom, second.freedom)
    return max(_LEAST_FACTOR, math.exp(_CONFIDENCE / math.sqrt(freedom)))


def gains(other: Fit, declared: Fit) -> tuple[float, float]:
    """Return the factors by which another reading's rotations and translations fit better."""
    return (
        declared.least_rotation / other.least_rotation,
        declared.least_translation / other.least_translation,
    )


def clearly_better(other: Fit, declared: Fit) -> bool:
    """Return whether another reading fits the noise, and the declared one clearly worse."""
    both = gains(other, declared)
    better = max(both) >= clear_factor(other, declared) and min(both) >= _NO_WORSE
    return better and other.like_noise


def as_good(other: Fit, best: Fit) -> bool:
    """Return whether two readings fit equally well."""
    return (
        other.least_rotation <= _AS_GOOD * best.least_rotation
        and other.least_translation <= _AS_GOOD * best.least_translation
    )


def simplest(fits: Sequence[Fit]) -> list[Fit]:
    """Return the best of some fits and those that are as good, the preferred one first.

    Conventions come before pairings, in the order of the table; of the pairings, those that leave
    the fewest stations unexplained come first: a shift that begins at the right station.
    """
    if not fits:
        return []
    best = min(fits, key=lambda each: each.score)
    equals = [each for each in fits if as_good(each, best)]
    return sorted(equals, key=lambda each: each.left_out if each.hypothesis.paired_anew else -1)
