"""What a result has to be worth: limits of a verification, and data that an answer can rest on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from handeye_cli.conventions import MM, MRAD
from handeye_cli.errors import QualityGateError, UndeterminedError
from handeye_cli.records import Inspection, Verification, VerificationRow
from handeye_cli.wording import error_sizes

WHEN_CONTRADICTED = (
    "look at the stations with the largest errors, at the findings of 'handeye solve', and at "
    "noise levels that were given"
)
"""The next step where held-out errors contradict their prediction."""


@dataclass(frozen=True)
class Limits:
    """What every row of a verification must keep.

    Attributes:
        rotation_mrad: Largest RMS rotation error, or None.
        translation_mm: Largest RMS translation error, or None.
        consistent: Whether a row that contradicts its prediction is refused.
    """

    rotation_mrad: float | None = None
    translation_mm: float | None = None
    consistent: bool = False

    def broken(
        self, rotation: float | None, translation: float | None, kind: str = ""
    ) -> Iterator[str]:
        """Yield what is wrong with errors that are above a limit.

        Args:
            rotation: RMS, radians, or None where nobody knows it.
            translation: RMS, metres, or None.
            kind: What they are, such as `predicted`.
        """
        for name, value, unit, sign, limit in (
            ("rotation", rotation, MRAD, "mrad", self.rotation_mrad),
            ("translation", translation, MM, "mm", self.translation_mm),
        ):
            # a limit that is no number is kept by nothing
            if limit is not None and value is not None and not value / unit <= limit:
                what = f"{kind} {name}".strip()
                yield f"expected a {what} error up to {limit:g} {sign}, found {value / unit:.3f}"


def check_limits(verification: Verification, limits: Limits) -> None:
    """Compare every row of a verification with the limits.

    Raises:
        QualityGateError: A row is above a limit, or contradicts its prediction.
    """
    broken = [text for row in verification.rows for text in _broken(row, limits)]
    if broken:
        raise QualityGateError("; ".join(broken), hint=_next_step(verification, limits))


def _next_step(verification: Verification, limits: Limits) -> str | None:
    """Return what to look at where errors contradict their prediction."""
    contradicted = any(row.consistent is False for row in verification.rows)
    if not (limits.consistent and contradicted):
        return None
    return WHEN_CONTRADICTED


def _broken(row: VerificationRow, limits: Limits) -> Iterator[str]:
    where = f"calibrated on {row.stations} stations"
    for text in limits.broken(row.rotation, row.translation):
        yield f"{where}: {text}"
    if limits.consistent and row.consistent is False:
        expected = _sizes(row.predicted_rotation, row.predicted_translation)
        found = _sizes(row.rotation, row.translation)
        yield (
            f"{where}: the errors contradict the prediction: expected about {expected}, "
            f"found {found}"
        )


def _sizes(rotation: float | None, translation: float | None) -> str:
    """Return RMS errors in radians and metres for people."""
    if rotation is None or translation is None:
        return "none"
    return error_sizes(rotation, translation)


def require_meaning(inspection: Inspection) -> None:
    """Check that an answer from inspected data would mean something.

    Raises:
        UndeterminedError: It would not.
    """
    errors = [finding.message for finding in inspection.errors]
    if errors:
        raise UndeterminedError("; ".join(errors), hint=inspection.errors[0].advice or None)
