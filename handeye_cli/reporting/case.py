"""A case: the documents that come from one recording and lead to one answer."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from handeye_cli.errors import HandeyeError
from handeye_cli.records import (
    Calibration,
    Features,
    Finding,
    Inspection,
    Plan,
    ProvenanceStep,
    Recording,
    Simulation,
    Stations,
    Verification,
)
from handeye_cli.records.basics import GRAVITY
from handeye_cli.records.batch import Batch
from handeye_cli.records.recording_summary import RecordingSummary

_MADE = "simulate recording"


@dataclass(frozen=True)
class Read:
    """A document or recording that was read.

    Attributes:
        name: The path as it was given.
        sha256: Digest of its bytes in hex.
        record: What it holds.
        asked: Whether the user named it, or it was found by what another document says of itself.
        summary: What a robot's recording holds, where it is one that the user named.
    """

    name: str
    sha256: str
    record: Any
    asked: bool = True
    summary: RecordingSummary | None = None

    @cached_property
    def ancestors(self) -> frozenset[str]:
        """Digests of all files that it was made from."""
        return frozenset(sha for step in self.history for _, sha in step.inputs)

    @property
    def root(self) -> str:
        """Digest of the file that it all began with, its own where it began with none."""
        firsts = [step.inputs[0][1] for step in self.history if step.inputs]
        return firsts[0] if firsts else self.sha256

    @property
    def history(self) -> tuple[ProvenanceStep, ...]:
        """How it came about from a recording; see `since_recording`."""
        return since_recording(self.record.provenance)


@dataclass(frozen=True)
class Case:
    """Documents of one recording, with one calibration at most.

    Attributes:
        name: Names it for people: the file of its calibration, or the first that was given.
        files: Names and SHA-256 of all its files.
        recording: Images and robot poses.
        features: Points found in the images.
        stations: Poses of the target.
        calibration: The answer.
        inspection: What is right and wrong with the data.
        verifications: Errors on stations that took no part.
        plans: Where to send the robot.
        simulations: Errors of simulated calibrations.
        batches: What came of many recordings.
        summary: What the robot's recording holds that all of it comes from, if that was named.
        attempted: Whether an answer was looked for while the report was made.
        failure: Why there is none, where the data looked good enough for one.
        remarks: What is to be said of the verifications that were made for the report.
    """

    name: str
    files: tuple[tuple[str, str], ...] = ()
    recording: Recording | None = None
    features: Features | None = None
    stations: Stations | None = None
    calibration: Calibration | None = None
    inspection: Inspection | None = None
    verifications: tuple[Verification, ...] = ()
    plans: tuple[Plan, ...] = ()
    simulations: tuple[Simulation, ...] = ()
    batches: tuple[Batch, ...] = ()
    summary: RecordingSummary | None = None
    attempted: bool = False
    failure: HandeyeError | None = None
    remarks: tuple[str, ...] = ()

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What all of its documents say of the data, each once, the gravest first."""
        early = (self.recording, self.features, self.stations)
        late = (
            self.calibration,
            self.inspection,
            *self.verifications,
            *self.plans,
            *self.simulations,
        )
        found = [
            *(finding for each in early if each for finding in each.findings),
            *(finding for each in late if each for finding in each.diagnosis),
        ]
        unique = {(each.code, each.message): each for each in found}
        return tuple(sorted(unique.values(), key=lambda each: GRAVITY.index(each.severity)))

    @property
    def provenance(self) -> tuple[ProvenanceStep, ...]:
        """How its answer came about, or what there is of it without one."""
        records = (
            self.calibration,
            *self.verifications,
            self.inspection,
            self.stations,
            self.features,
            self.recording,
            *self.plans,
            *self.simulations,
            *self.batches,
        )
        return longest(each.provenance for each in records if each is not None)


def since_recording(steps: Sequence[ProvenanceStep]) -> tuple[ProvenanceStep, ...]:
    """Return the steps behind the making of a recording.

    Recordings made from the same plan have nothing else in common.
    """
    made = [index for index, step in enumerate(steps) if step.command == _MADE]
    return tuple(steps[made[-1] + 1 :] if made else steps)


def longest(ways: Iterable[tuple[ProvenanceStep, ...]]) -> tuple[ProvenanceStep, ...]:
    """Return the first of the longest ones among several histories; nothing of none."""
    return max(ways, key=len, default=())
