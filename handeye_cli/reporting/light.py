"""The traffic light of a report: one colour, and the reasons for it in words."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from handeye_cli.errors import QualityGateError
from handeye_cli.gates import WHEN_CONTRADICTED, Limits, check_limits
from handeye_cli.records import Protocol, Verification, VerificationRow
from handeye_cli.reporting.batch_light import RowLight, reasons, row_lights
from handeye_cli.reporting.case import Case
from handeye_cli.reporting.colour import Colour
from handeye_cli.wording import error_sizes

NOT_VERIFIED = "predicted only, not verified"
"""What is said of an answer whose error nobody looked at."""


@dataclass(frozen=True)
class Light:
    """The verdict on a case.

    Attributes:
        colour: The worst of what speaks against it.
        reasons: What does, each in a sentence without its full stop; what speaks for it when green.
        verified: Whether errors were seen on stations that took no part in an answer.
    """

    colour: Colour
    reasons: tuple[str, ...]
    verified: bool


def judge(case: Case, limits: Limits) -> Light | None:
    """Return the light of a case, or None where it holds nothing that could be judged.

    Red: a limit is broken, a finding is an error, held-out errors contradict their prediction, or
    there is no answer though one was looked for. Amber: there are warnings. Green otherwise. A
    batch is as good as the worst of its recordings.

    Args:
        case: With all that is known of it.
        limits: What the predicted error and every row of a verification must keep.
    """
    if not _can_be_judged(case):
        return None
    rows = tuple(light for batch in case.batches for light in row_lights(batch, limits))
    verified = bool(case.verifications) or any(each.row.seen_rotation is not None for each in rows)
    for colour, against in (
        (Colour.RED, (*_against(case, limits), *reasons(rows, Colour.RED))),
        (Colour.AMBER, (*_messages(case, "warning"), *reasons(rows, Colour.AMBER))),
    ):
        if against:
            return Light(colour, against, verified)
    return Light(Colour.GREEN, tuple(_for(case, rows)), verified)


def _can_be_judged(case: Case) -> bool:
    """Return whether an answer was found, or data were looked at that should give one."""
    looked = case.inspection
    judged = looked is not None and bool(looked.stations or looked.errors or case.attempted)
    return judged or bool(case.calibration or case.verifications or case.batches or case.failure)


def nearest_row(case: Case) -> tuple[Verification, VerificationRow] | None:
    """Return the row of the verifications that calibrates on most stations, nearest to the answer.

    Of rows with as many stations it is that of the first verification.
    """
    rows = [(each, row) for each in case.verifications for row in each.rows]
    return max(rows, key=lambda pair: pair[1].stations, default=None)


def broken_limits(case: Case, limits: Limits) -> tuple[str, ...]:
    """Return what breaks the limits: of predicted and held-out errors, those of batches too."""
    lights = (light for batch in case.batches for light in row_lights(batch, limits))
    of_batches = (text for light in lights for text in light.broken)
    return (*_own_broken_limits(case, limits), *of_batches)


def _own_broken_limits(case: Case, limits: Limits) -> tuple[str, ...]:
    return (*_predicted_above(case, limits), *_seen_above(case, limits))


def _against(case: Case, limits: Limits) -> Iterator[str]:
    yield from _own_broken_limits(case, limits)
    yield from _messages(case, "error")
    if case.failure is not None:
        yield case.failure.message
    for verification in case.verifications:
        for row in verification.rows:
            if row.consistent is False:
                yield _contradiction(verification, row)


def _contradiction(verification: Verification, row: VerificationRow) -> str:
    seen = _pair(row.rotation, row.translation)
    expected = _pair(row.predicted_rotation, row.predicted_translation)
    each = verification.protocol is Protocol.LEAVE_ONE_OUT
    where = "at stations left out one by one" if each else f"calibrated on {row.stations} stations"
    how = (
        f"{seen} RMS where {expected} is expected"
        if _is_above(row)
        else f"their RMS, {seen}, is no larger than the {expected} expected, but they are not "
        "spread over stations and directions as expected"
    )
    message = f"held-out errors contradict their prediction beyond chance, {where}: {how}"
    return f"{message}; {WHEN_CONTRADICTED}"


def _is_above(row: VerificationRow) -> bool:
    rotation, translation = row.predicted_rotation or 0.0, row.predicted_translation or 0.0
    return row.rotation > rotation or row.translation > translation


def _pair(rotation: float | None, translation: float | None) -> str:
    return error_sizes(rotation or 0.0, translation or 0.0)


def _messages(case: Case, severity: str) -> tuple[str, ...]:
    return tuple(each.message for each in case.findings if each.severity == severity)


def _for(case: Case, rows: tuple[RowLight, ...]) -> Iterator[str]:
    if rows:
        yield f"nothing speaks against any of the {len(rows)} recordings"
        return
    yield "nothing in the data speaks against it"
    if not case.verifications:
        yield NOT_VERIFIED
    elif any(row.consistent for each in case.verifications for row in each.rows):
        yield "the errors on stations that took no part are as predicted"
    else:
        yield "there are errors on stations that took no part, but nothing that predicts them"


def _predicted_above(case: Case, limits: Limits) -> Iterator[str]:
    if case.calibration is not None:
        error = case.calibration.predicted_error
        yield from limits.broken(error.rotation, error.translation, "predicted")


def _seen_above(case: Case, limits: Limits) -> Iterator[str]:
    for verification in case.verifications:
        try:
            check_limits(verification, limits)
        except QualityGateError as error:
            yield error.message
