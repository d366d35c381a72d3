"""Many recordings, each solved and verified on its own: a line of a table for each."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from handeye_cli.records.basics import ProvenanceStep

CANCELLED_CODE = 130
"""Exit code of a command that was interrupted, as shells have it."""


class BatchStatus(StrEnum):
    """How it went with one recording."""

    FAILED = "failed"
    """There is no answer, or no verification of it."""
    GATE = "gate"
    """An error is above its limit, or contradicts its prediction where that is refused."""
    CANCELLED = "cancelled"
    """The batch was interrupted before it was done."""
    WARNINGS = "warnings"
    """All limits are kept, but something is to be looked at."""
    OK = "ok"
    """All is well."""


@dataclass(frozen=True)
class BatchRow:
    """What came of one recording; what it did not come to is None.

    Attributes:
        name: The recording as it was named.
        status: How it went.
        exit_code: What the single commands would have left with.
        sha256: Digest of what was read, in hex.
        stations: Number of stations of the recording.
        used: How many of them the calibration rests on.
        predicted_rotation: RMS error that is expected of the answer's rotation, radians.
        predicted_translation: The same of its translation, metres.
        seen_rotation: RMS error at stations that took no part, radians.
        seen_translation: The same, metres.
        consistent: Whether the errors seen are as predicted, within chance.
        findings: Codes of the warnings and errors that were found about the data.
        message: Why it failed.
        advice: The next step then.
        calibration: File that holds the answer.
        seconds: How long it took.
    """

    name: str
    status: BatchStatus = BatchStatus.OK
    exit_code: int = 0
    sha256: str | None = None
    stations: int | None = None
    used: int | None = None
    predicted_rotation: float | None = None
    predicted_translation: float | None = None
    seen_rotation: float | None = None
    seen_translation: float | None = None
    consistent: bool | None = None
    findings: tuple[str, ...] = ()
    message: str | None = None
    advice: str | None = None
    calibration: str | None = None
    seconds: float | None = None


@dataclass(frozen=True)
class Batch:
    """A line for each recording, in the order they were named."""

    rows: tuple[BatchRow, ...]
    provenance: tuple[ProvenanceStep, ...] = ()

    @property
    def exit_code(self) -> int:
        """What the whole batch leaves with.

        That is 130 when it was interrupted, else the smallest code above 0 of a row, since codes
        become less grave as they grow: a limit that was missed (6) shows only where nothing failed.
        """
        codes = {row.exit_code for row in self.rows if row.exit_code}
        return CANCELLED_CODE if CANCELLED_CODE in codes else min(codes, default=0)

    def count(self, status: BatchStatus) -> int:
        """Return the number of rows of a status."""
        return sum(row.status is status for row in self.rows)

    def worst_first(self) -> tuple[BatchRow, ...]:
        """Return the rows by status, exit code and seen translation error, the worst first."""
        order = list(BatchStatus)
        return tuple(
            sorted(
                self.rows,
                key=lambda row: (
                    order.index(row.status),
                    row.exit_code,
                    -(row.seen_translation or 0.0),
                ),
            )
        )
