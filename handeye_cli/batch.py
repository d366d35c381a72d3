"""Stage: one recording of many, solved and verified, with whatever comes of it in one row.

An error ends the work on its recording and becomes the row's exit code and message, so that the
other recordings go on. What had been found before it stays in the row.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

from handeye_cli import gates, pipeline
from handeye_cli.errors import HandeyeError, QualityGateError
from handeye_cli.pipeline import Steps
from handeye_cli.records import Calibration, Finding, Stations, Verification
from handeye_cli.records.batch import BatchRow, BatchStatus


@dataclass(frozen=True)
class Treatment:
    """How every recording of a batch is solved and verified.

    Attributes:
        method: A row of the table of solvers.
        pairs: `star` or `all`.
        calibrate_intrinsics: Whether the intrinsics are estimated from the same images.
        existing: An answer to verify instead of the recording's own, or None.
        counts: Stations to calibrate on for each row of the verification; half when None.
        leave_one_out: Whether each station is predicted by a calibration on all others.
        target_moved: Whether the target was moved since the existing answer was found.
        limits: What the errors seen must keep.
    """

    method: str
    pairs: str = "star"
    calibrate_intrinsics: bool = False
    existing: Calibration | None = None
    counts: tuple[int, ...] | None = None
    leave_one_out: bool = False
    target_moved: bool = False
    limits: gates.Limits = field(default_factory=gates.Limits)


@dataclass(frozen=True)
class Outcome:
    """A row, and the answer where there is one; provenance does not know of the batch yet."""

    row: BatchRow
    calibration: Calibration | None = None


def outcome_of(name: str, opening: Callable[[], tuple[Any, str]], treatment: Treatment) -> Outcome:
    """Solve and verify one recording as far as it goes.

    Args:
        name: What the recording is called.
        opening: Reads it; returns any record up to the stations, and the digest of its file.
        treatment: How it is solved and verified.

    Returns:
        Its row, and its calibration if `handeye solve` would have found one.
    """
    outcome = Outcome(BatchRow(name))
    try:
        for reached in _stages(outcome.row, opening, treatment):
            outcome = reached
    except HandeyeError as error:
        return replace(outcome, row=failed(outcome.row, error))
    return replace(outcome, row=_with_verdict(outcome.row))


def failed(row: BatchRow, error: HandeyeError) -> BatchRow:
    """Return a row that ends with an error."""
    return replace(
        row,
        status=BatchStatus.GATE if isinstance(error, QualityGateError) else BatchStatus.FAILED,
        exit_code=error.exit_code,
        message=": ".join(filter(None, (_place(row.name, error.where), error.message))),
        advice=error.hint,
    )


def _place(name: str, where: str | None) -> str:
    """Return where an error is without the recording's own name, which the row has already."""
    return (where or "").removeprefix(name).lstrip(",: ")


def _stages(
    row: BatchRow, opening: Callable[[], tuple[Any, str]], treatment: Treatment
) -> Iterator[Outcome]:
    """Yield the outcome after each stage."""
    record, sha256 = opening()
    row = replace(row, sha256=sha256)
    yield Outcome(row)
    # the recordings are worked on side by side: one at a time goes through its images alone
    steps = Steps(workers=1, calibrate_intrinsics=treatment.calibrate_intrinsics)
    stations = pipeline.ready_stations(record, steps)
    row = replace(row, stations=len(stations.stations))
    yield Outcome(row)
    calibration = pipeline.to_calibration(
        stations, Steps(workers=1), method=treatment.method, pairs=treatment.pairs
    )
    row = _with_answer(row, calibration)
    yield Outcome(row, calibration)
    verification = _verified(stations, treatment)
    row = _with_errors(row, verification)
    yield Outcome(row, calibration)
    gates.check_limits(verification, treatment.limits)


def _verified(stations: Stations, treatment: Treatment) -> Verification:
    return pipeline.to_verification(
        stations,
        Steps(workers=1),
        treatment.existing,
        counts=treatment.counts,
        method=treatment.method,
        pairs=treatment.pairs,
        leave_one_out=treatment.leave_one_out,
        target_moved=treatment.target_moved,
    )


def _with_answer(row: BatchRow, calibration: Calibration) -> BatchRow:
    return replace(
        row,
        used=sum(station.used for station in calibration.stations),
        predicted_rotation=calibration.predicted_error.rotation,
        predicted_translation=calibration.predicted_error.translation,
        findings=_codes(calibration.diagnosis),
    )


def _with_errors(row: BatchRow, verification: Verification) -> BatchRow:
    """Return the row with the errors of the verification's line on the most stations."""
    line = max(verification.rows, key=lambda each: each.stations)
    verdicts = {each.consistent for each in verification.rows}
    codes = (*row.findings, *_codes(verification.diagnosis))
    return replace(
        row,
        seen_rotation=line.rotation,
        seen_translation=line.translation,
        consistent=False if False in verdicts else line.consistent,
        findings=tuple(dict.fromkeys(codes)),
    )


def _with_verdict(row: BatchRow) -> BatchRow:
    doubtful = bool(row.findings) or row.consistent is False
    return replace(row, status=BatchStatus.WARNINGS if doubtful else BatchStatus.OK)


def _codes(findings: Iterable[Finding]) -> tuple[str, ...]:
    grave = (finding.code for finding in findings if finding.severity != "info")
    return tuple(dict.fromkeys(grave))
