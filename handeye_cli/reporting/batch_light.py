"""The traffic lights of a batch: one for each recording, and what they come to."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from handeye_cli.gates import Limits
from handeye_cli.records.batch import Batch, BatchRow, BatchStatus
from handeye_cli.reporting.colour import Colour
from handeye_cli.wording import first_few

_COLOURS = {
    BatchStatus.FAILED: Colour.RED,
    BatchStatus.GATE: Colour.RED,
    BatchStatus.CANCELLED: Colour.AMBER,
    BatchStatus.WARNINGS: Colour.AMBER,
    BatchStatus.OK: Colour.GREEN,
}
_WORDS = {
    BatchStatus.FAILED: "no answer, or none that could be verified",
    BatchStatus.GATE: "a limit was missed",
    BatchStatus.CANCELLED: "not done when the batch was interrupted",
    BatchStatus.WARNINGS: "something is to be looked at",
}
_ABOVE = "an error is above a limit of this report"
_MOST_NAMES = 5
"""Recordings that a reason names."""


@dataclass(frozen=True)
class RowLight:
    """The verdict on one recording of a batch.

    Attributes:
        row: The recording.
        colour: What to do with its answer.
        reason: Why, or no text where all is well.
        broken: What breaks the limits of the report, each with its numbers.
    """

    row: BatchRow
    colour: Colour
    reason: str
    broken: tuple[str, ...] = ()


def row_lights(batch: Batch, limits: Limits) -> tuple[RowLight, ...]:
    """Return the light of each recording, the worst on top.

    Args:
        batch: What came of them.
        limits: What the predicted and the seen errors must keep, beside the batch's own limits.
    """
    lights = [_row_light(row, limits) for row in batch.worst_first()]
    order = list(Colour)
    return tuple(sorted(lights, key=lambda each: order.index(each.colour)))


def reasons(lights: Sequence[RowLight], colour: Colour) -> Iterator[str]:
    """Yield why recordings are of a colour: each reason with how many, and which they are."""
    of_colour = [each for each in lights if each.colour is colour]
    for reason in dict.fromkeys(each.reason for each in of_colour):
        names = [each.row.name for each in of_colour if each.reason == reason]
        yield f"{reason}: {len(names)} of {len(lights)}: {first_few(names, _MOST_NAMES)}"


def _row_light(row: BatchRow, limits: Limits) -> RowLight:
    colour, broken = _COLOURS[row.status], tuple(_broken(row, limits))
    if broken and colour is not Colour.RED:
        return RowLight(row, Colour.RED, _ABOVE, broken)
    return RowLight(row, colour, _WORDS.get(row.status, ""), broken)


def _broken(row: BatchRow, limits: Limits) -> Iterator[str]:
    for kind, rotation, translation in (
        ("predicted", row.predicted_rotation, row.predicted_translation),
        ("seen", row.seen_rotation, row.seen_translation),
    ):
        for text in limits.broken(rotation, translation, kind):
            yield f"{row.name}: {text}"
