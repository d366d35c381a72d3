"""Stations that contradict the others, and what is known of why."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from handeye_cli.records.basics import IntArray, Noise

_FEWEST = 4
"""Three stations always agree to some degree."""
_FEWEST_FOR_THIRD = 7


def most_bad(count: int) -> int:
    """Return how many bad stations of so many can be told from good ones.

    A third; only one of fewer than seven, and none of fewer than four.
    """
    return count // 3 if count >= _FEWEST_FOR_THIRD else int(count >= _FEWEST)


class BadKind(StrEnum):
    """What a bad station looks like."""

    ELSEWHERE = "elsewhere"
    """It sees the target in another place: target, camera pose or robot pose are wrong."""
    TURNED = "turned"
    """It sees the target turned by quarters or a half about its normal: its points are misnamed."""
    EXCHANGED = "exchanged"
    """Its image fits the robot pose of another bad station."""


@dataclass(frozen=True)
class BadStation:
    """A station that the others contradict.

    Attributes:
        row: Its row in the chain.
        rotation: Angle between where it and where all others see the target, radians.
        translation: Distance between the two places of the target's origin, metres.
        sigmas: The six residuals together, in standard deviations of their prediction.
        chance: Probability of a distance as large as this if the station were good.
        kind: What it looks like.
    """

    row: int
    rotation: float
    translation: float
    sigmas: float
    chance: float
    kind: BadKind = BadKind.ELSEWHERE


@dataclass(frozen=True)
class TargetMove:
    """A target that was moved once during the recording.

    Attributes:
        before: Row of the last station that sees it in its first place.
        after: Row of the first station that sees it in its second place.
        rotation: Angle between the two, radians.
        translation: Distance between the two places of its origin, metres.
        sigmas: Both together, in standard deviations.
        rows: The stations on the side of the move where fewer are.
    """

    before: int
    after: int
    rotation: float
    translation: float
    sigmas: float
    rows: tuple[int, ...]


@dataclass(frozen=True)
class BadStations:
    """What was found out about the stations of a chain.

    Attributes:
        count: How many stations the chain has.
        outliers: Those that the others contradict, by row.
        exchanged: Rows whose images and robot poses are interchanged: the image of each belongs to
            the robot pose of the next, and that of the last to the first. Two rows are exchanged.
        moved: The target's move, if there was one.
        scale: The noise as the good stations show it, or as it was given.
        noise_given: Whether all of it was given, so that nothing followed from the stations.
    """

    count: int
    outliers: tuple[BadStation, ...] = ()
    exchanged: tuple[tuple[int, ...], ...] = ()
    moved: TargetMove | None = None
    scale: Noise = field(default_factory=Noise)
    noise_given: bool = False

    @property
    def too_many(self) -> bool:
        """Whether more are bad than can be told from good ones."""
        return len(self.outliers) > most_bad(self.count)

    @property
    def left_out(self) -> tuple[int, ...]:
        """The rows an answer should do without; none where too many are bad."""
        if self.too_many:
            return ()
        apart = self.moved.rows if self.moved else ()
        return tuple(sorted({*apart, *(station.row for station in self.outliers)}))

    @property
    def kept(self) -> IntArray:
        """The rows an answer should rest on."""
        return np.setdiff1d(np.arange(self.count), np.array(self.left_out, dtype=np.int64))


@dataclass(frozen=True)
class WithoutBadStations:
    """How far the answers with and without the bad stations are apart.

    Attributes:
        left_out: Names of the stations that were left out.
        rotation: Angle between the two answers' rotations, radians.
        translation: Distance between their translations, metres.
    """

    left_out: tuple[str, ...]
    rotation: float
    translation: float
