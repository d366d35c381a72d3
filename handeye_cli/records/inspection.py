"""What a look at the data finds, before or instead of an answer."""

from __future__ import annotations

from dataclasses import dataclass

from handeye_cli.conventions import Setup
from handeye_cli.records.basics import Finding, ProvenanceStep
from handeye_cli.records.blame import BlameShares, SmoothResiduals
from handeye_cli.records.free import FreeDirection
from handeye_cli.records.hypotheses import HypothesisFit, LengthRatio
from handeye_cli.records.moving import TimeOffset
from handeye_cli.records.recording_summary import RecordingSummary
from handeye_cli.records.results import PredictedError, StationResidual


@dataclass(frozen=True)
class Inspection:
    """What is right and what is wrong with the data of a calibration.

    Attributes:
        setup: As declared, or None where only a recording was looked into and nobody said it.
        stations: Every station of the input: whether it can be used, how far it is from the others,
            or why it cannot.
        diagnosis: All findings, the gravest first.
        hypotheses: Readings of the conventions that were tried, the best fit first; nothing where
            the stations do not tell them apart.
        length_ratio: Lengths of the robot's motions over the camera's, where they are told.
        free: Directions of the answer that the data leave free.
        predicted_error: Expected error of the answer, where there is one.
        surfaces: What smooth surfaces explain of the residuals in the images; None without pixels.
        blame: What the stations' residuals are put down to, where there is an answer.
        time_offset: The time between images and the robot's poses, where frames in motion tell it.
        recording: What the robot's recording holds that the data come from, if they come from one.
        provenance: How it came about.
    """

    setup: Setup | None
    stations: tuple[StationResidual, ...]
    diagnosis: tuple[Finding, ...] = ()
    hypotheses: tuple[HypothesisFit, ...] = ()
    length_ratio: LengthRatio | None = None
    free: tuple[FreeDirection, ...] = ()
    predicted_error: PredictedError | None = None
    surfaces: SmoothResiduals | None = None
    blame: BlameShares | None = None
    time_offset: TimeOffset | None = None
    recording: RecordingSummary | None = None
    provenance: tuple[ProvenanceStep, ...] = ()

    @property
    def errors(self) -> tuple[Finding, ...]:
        """What makes an answer meaningless."""
        return tuple(finding for finding in self.diagnosis if finding.severity == "error")
