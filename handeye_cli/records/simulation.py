"""What simulated calibrations came to: one setting, or figures of the paper in which one varies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

from handeye_cli.conventions import Setup
from handeye_cli.records.basics import Finding, Noise, ProvenanceStep
from handeye_cli.records.results import PaperPrediction


@dataclass(frozen=True)
class SimulationSetting:
    """What is simulated: the paper's stations, section IV-A, and how they are calibrated.

    Attributes:
        stations: N, on the paper's circle.
        distance: |T_c|, from the camera to the target's origin, metres.
        tilt: Of every station, radians.
        lever: |T_cg|, from the gripper to the camera, metres; its direction is left to chance.
        noise: RMS magnitudes of the stations' errors; `pixel` is not used.
        method: A row of the table of solvers.
        pairs: How interstation pairs are chosen, `star` or `all`.
    """

    stations: int
    distance: float
    tilt: float
    lever: float
    noise: Noise
    method: str
    pairs: str


@dataclass(frozen=True)
class ErrorBound:
    """The Cramer-Rao bound: no unbiased method has smaller RMS errors.

    Attributes:
        rotation: Radians.
        translation: Metres.
    """

    rotation: float
    translation: float


@dataclass(frozen=True)
class SimulatedErrors:
    """How far from the truth the answers were.

    Attributes:
        rotation_rms: RMS angle over all trials, radians.
        rotation_max: The largest, radians.
        translation_rms: RMS distance, metres.
        translation_max: The largest, metres.
        predicted: What the paper's formulas predict for the closed form.
        bound: What no method can be better than.
    """

    rotation_rms: float
    rotation_max: float
    translation_rms: float
    translation_max: float
    predicted: PaperPrediction
    bound: ErrorBound


class Abscissa(StrEnum):
    """What a figure's errors are drawn against."""

    ANGLE = "1 / interstation angle"
    AXES = "1 / sin(angle between interstation axes)"
    DISTANCE = "distance from camera to target"
    PAIRS = "1 / sqrt(number of interstation pairs)"

    @property
    def unit(self) -> str:
        """Unit for people; empty for a plain number."""
        return {Abscissa.ANGLE: "1/rad", Abscissa.DISTANCE: "mm"}.get(self, "")

    @property
    def varied(self) -> str:
        """What of the setting takes another value at each point."""
        names = {Abscissa.ANGLE: "tilt", Abscissa.DISTANCE: "distance"}
        return names.get(self, "stations")


class Ordinate(StrEnum):
    """Which error a figure shows."""

    ROTATION = "rotation error"
    TRANSLATION = "translation error"

    @property
    def unit(self) -> str:
        """Unit for people, a thousandth of that inside."""
        return "mrad" if self is Ordinate.ROTATION else "mm"


FIGURES: Mapping[int, tuple[Abscissa, Ordinate]] = MappingProxyType(
    {
        8: (Abscissa.ANGLE, Ordinate.ROTATION),
        9: (Abscissa.ANGLE, Ordinate.TRANSLATION),
        10: (Abscissa.AXES, Ordinate.ROTATION),
        11: (Abscissa.DISTANCE, Ordinate.TRANSLATION),
        12: (Abscissa.PAIRS, Ordinate.TRANSLATION),
        13: (Abscissa.PAIRS, Ordinate.ROTATION),
    }
)
"""The axes of the paper's figures of simulations, by their numbers."""


@dataclass(frozen=True)
class FigurePoint:
    """One setting in a figure; all errors are of its ordinate, in radians or metres.

    Attributes:
        abscissa: 1/rad, metres or a plain number.
        rms: Over all trials.
        largest: Of all trials.
        predicted: RMS by the paper's formula.
        bound: RMS by the Cramer-Rao bound.
    """

    abscissa: float
    rms: float
    largest: float
    predicted: float
    bound: float


@dataclass(frozen=True)
class StraightLine:
    """The straight line nearest to the RMS errors of a figure.

    Attributes:
        slope: Radians or metres per unit of the abscissa.
        intercept: Radians or metres at 0.
        r_squared: Share of the errors' variance that the line explains; 1 for a straight line.
    """

    slope: float
    intercept: float
    r_squared: float


@dataclass(frozen=True)
class SimulatedFigure:
    """A figure of the paper, simulated.

    Attributes:
        number: 8 to 13.
        points: By rising abscissa.
        line: Fitted to their RMS errors.
    """

    number: int
    points: tuple[FigurePoint, ...]
    line: StraightLine

    @property
    def abscissa(self) -> Abscissa:
        """What its errors are drawn against."""
        return FIGURES[self.number][0]

    @property
    def ordinate(self) -> Ordinate:
        """Which error it shows."""
        return FIGURES[self.number][1]


@dataclass(frozen=True)
class Simulation:
    """Simulated calibrations: the errors of one setting, or figures around it.

    Attributes:
        setup: Where the camera is fixed.
        setting: What was simulated; a figure puts its own values in the place of what it varies.
        trials: Calibrations in each setting.
        seed: Of all chance.
        errors: Of the setting itself; None where there are figures.
        figures: Figures of the paper.
        diagnosis: Findings.
        provenance: How it came about.
    """

    setup: Setup
    setting: SimulationSetting
    trials: int
    seed: int
    errors: SimulatedErrors | None = None
    figures: tuple[SimulatedFigure, ...] = ()
    diagnosis: tuple[Finding, ...] = ()
    provenance: tuple[ProvenanceStep, ...] = ()
