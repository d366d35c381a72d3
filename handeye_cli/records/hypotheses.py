"""What the data say about the conventions they were declared in."""

from __future__ import annotations

from dataclasses import dataclass

from handeye_cli.records.basics import Finding


@dataclass(frozen=True)
class LengthRatio:
    """Lengths of the robot's motions over those of the camera's; 1 for consistent units.

    Attributes:
        ratio: The ratio, 1 where the motions do not tell it.
        sigma: Its relative standard deviation; infinite where the motions do not tell it.
    """

    ratio: float
    sigma: float


@dataclass(frozen=True)
class HypothesisFit:
    """How well the stations agree when their numbers are read in one of the possible ways.

    The fits are of the stations that agree best, so that a bad one does not decide.

    Attributes:
        code: Stable short name in kebab-case; `declared` for the conventions as they were declared.
        description: The reading in words, to follow "if".
        flag: What has to be said on the command line for it, empty where no flag does it.
        rotation: RMS angle by which the stations see the target turned, radians.
        translation: RMS distance by which they see it moved, metres, with lengths of robot and
            camera in the ratio that fits best; where that is not 1, in lengths half-way between.
    """

    code: str
    description: str
    flag: str
    rotation: float
    translation: float


@dataclass(frozen=True)
class ConventionVerdict:
    """Whether the declared conventions fit, and if not, which do.

    Attributes:
        hypotheses: Those that were tried, the declared one among them, the best fit first.
        declared: The conventions as they were declared.
        best: What the data speak for: another one than the declared only where the evidence is
            clear.
        scale: Lengths of the robot over those of the camera under `best`.
        findings: What is wrong, the most important first; empty where nothing is.
        contradiction: Whether the data contradict what was declared.
    """

    hypotheses: tuple[HypothesisFit, ...]
    declared: HypothesisFit
    best: HypothesisFit
    scale: LengthRatio
    findings: tuple[Finding, ...]
    contradiction: bool
