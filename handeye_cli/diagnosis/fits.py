"""How well hypotheses fit, and which of them the data speak for."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from handeye_cli.diagnosis.hypotheses import Hypothesis
from handeye_cli.geometry import statistics
from handeye_cli.geometry.motion_invariants import (
    BoolArray,
    RotationFit,
    TranslationFit,
    fit_rotations,
    fit_translations,
    second_turn,
    turned_answers,
)
from handeye_cli.geometry.observability import half_turns
from handeye_cli.records import FloatArray, IntArray

_AT_ONCE = 64
"""Hypotheses that are fitted together; more would cost memory and save no time."""
_FINEST_TURN = 1e-4
"""Radians below which the residual of a rotation is as good as none."""
_FINEST_SHARE = 1e-4
"""Share of the motions' lengths below which the residual of a translation is as good as none."""
_FINEST_LENGTH = 1e-9
"""The same in metres, where there is no motion."""
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
        return max(self.translation, _FINEST_SHARE * self.reach, _FINEST_LENGTH)

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
        return self.unexplained_by(self)

    def unexplained_by(self, noisy: Fit) -> int:
        """Return how many stations do not agree, or take no part, with noise as another fit has.

        Args:
            noisy: The fit; where this one has more noise of a kind, its own counts.
        """
        rotation = max(self.least_rotation, noisy.least_rotation)
        translation = max(self.least_translation, noisy.least_translation)
        limits = _EXPLAINED * np.array([[rotation], [translation]])
        return int(np.sum(np.any(self.residuals > limits, axis=0)))

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


class _Stacked(NamedTuple):
    """Readings of N stations along leading axes: poses, which of them exist, how many count.

    (..., N, 4, 4) A and B, (..., N) mask and (...) trusted.
    """

    A: FloatArray
    B: FloatArray
    mask: BoolArray
    trusted: IntArray

    def repeated(self, count: int) -> _Stacked:
        """Return the same along one leading axis and a further one, of `count` alike."""
        arrays: Iterable[NDArray[Any]] = self
        return _Stacked(*(np.repeat(each[:, None], count, axis=1) for each in arrays))


def _fit_together(hypotheses: Sequence[Hypothesis], most: int | None) -> list[Fit]:
    mask = np.stack([each.mask for each in hypotheses])
    count = np.sum(mask, axis=-1)
    trusted = _trusted(count) if most is None else np.minimum(count, most)
    A = np.stack([each.A for each in hypotheses])
    B = np.stack([each.B for each in hypotheses])
    turned, moved = _fitted(_Stacked(A, B, mask, trusted))
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


def _fitted(stacked: _Stacked) -> tuple[RotationFit, TranslationFit]:
    """Fit readings along one leading axis.

    Half turns leave several answers to rotations alone, of which the translations tell the one.
    """
    A, B, mask, trusted = stacked
    turned = fit_rotations(A[..., :3, :3], B[..., :3, :3], mask, trusted)
    moved = fit_translations(A, B, turned, mask, trusted)
    first = np.argmax(turned.kept, axis=-1)[:, None, None, None]
    seen = B[..., :3, :3].mT
    halves = half_turns(np.take_along_axis(seen, first, axis=1)[:, 0], seen) & turned.kept
    rows = np.flatnonzero(halves.any(axis=-1))
    if len(rows) == 0:
        return turned, moved
    before = RotationFit(*_rows_of(turned, rows))
    some = _Stacked(*_rows_of(stacked, rows))
    others, again = _other_answers(some, before)
    limit = _chance_factor(3 * some.trusted - 6) * np.maximum(before.rms, _FINEST_TURN)
    scores = np.where(others.rms <= limit[:, None], _scores(others, again), np.inf)
    better = np.flatnonzero(scores.min(axis=1) < _scores(turned, moved)[rows])
    chosen = better, np.argmin(scores, axis=1)[better]
    return (
        RotationFit(*_replaced(turned, others, rows[better], chosen)),
        TranslationFit(*_replaced(moved, again, rows[better], chosen)),
    )


def _other_answers(stacked: _Stacked, before: RotationFit) -> tuple[RotationFit, TranslationFit]:
    """Return the fits of what half turns allow beside what was found, along a further axis."""
    A, B, mask, trusted = stacked
    others = turned_answers(A[..., :3, :3], B[..., :3, :3], before, mask, trusted)
    A, B, mask, trusted = stacked.repeated(others.rms.shape[1])
    return others, fit_translations(A, B, others, mask, trusted)


def _scores(turned: RotationFit, moved: TranslationFit) -> FloatArray:
    """Return (...) logarithms of the products of both residuals, as `Fit.score`."""
    finest = np.maximum(_FINEST_SHARE * moved.reach, _FINEST_LENGTH)
    parts = np.maximum(turned.rms, _FINEST_TURN) * np.maximum(moved.rms, finest)
    return np.asarray(np.log(parts))


def _rows_of(arrays: Iterable[NDArray[Any]], rows: IntArray) -> Iterator[NDArray[Any]]:
    return (each[rows] for each in arrays)


def _replaced(
    fits: Iterable[NDArray[Any]],
    others: Iterable[NDArray[Any]],
    rows: IntArray,
    chosen: tuple[IntArray, IntArray],
) -> Iterator[NDArray[Any]]:
    """Yield the arrays of some fits, with rows of them taken from others."""
    for one, other in zip(fits, others, strict=True):
        changed = one.copy()
        changed[rows] = other[chosen]
        yield changed


def _trusted(count: IntArray) -> IntArray:
    """Return how many of some stations are trusted to agree: two may be bad, or a fifth of many.

    Of few stations fewer may be bad: what three or four are left to say, any reading satisfies.
    """
    return count - np.maximum(np.clip((count - 3) // 2, 0, 2), count // 5)


def clear_factor(first: Fit, second: Fit) -> float:
    """Return the factor between residuals of two fits that chance does not bring about.

    The logarithm of an RMS of f independent residuals scatters by 1 / sqrt(2 f).
    """
    return float(_chance_factor(np.array(min(first.freedom, second.freedom))))


def _chance_factor(freedom: IntArray) -> FloatArray:
    scatter = _CONFIDENCE / np.sqrt(np.maximum(freedom, 1))
    return np.asarray(np.maximum(_LEAST_FACTOR, np.exp(scatter)))


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
