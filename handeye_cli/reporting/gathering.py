"""Which of several documents belong together, by the digests of what they were made from."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from handeye_cli.errors import InputError, UsageError
from handeye_cli.records import (
    Calibration,
    Features,
    Inspection,
    Plan,
    Recording,
    Simulation,
    Stations,
    Verification,
)
from handeye_cli.records.batch import Batch
from handeye_cli.reporting.case import Case, Read

_ONE: dict[str, type] = {
    "recording": Recording,
    "features": Features,
    "stations": Stations,
    "inspection": Inspection,
}
"""Slots of a case that one document fills, and its kind."""
_MANY: dict[str, type] = {
    "verifications": Verification,
    "plans": Plan,
    "simulations": Simulation,
    "batches": Batch,
}
"""Slots that hold all documents of a kind."""


def gather(reads: Sequence[Read]) -> tuple[Case, ...]:
    """Return the cases that documents make.

    Documents belong together when one was made from the other or both from the same file. Each
    calibration is a case of its own, with the documents it was made from and those made from it;
    what belongs to none of several calibrations more than to the others belongs to all of them.

    Args:
        reads: What was read, in the order of the page. Of what nobody asked for, only that is kept
            which belongs to something that was.

    Raises:
        UsageError: Two documents of one kind would have the same place in a case.
        InputError: A page has no place for a document that was asked for.
    """
    for read in reads:
        if read.asked:
            _require_place(read)
    together = (each for each in _components(reads) if any(read.asked for read in each))
    return tuple(case for each in together for case in _cases(each))


def _require_place(read: Read) -> None:
    kinds = (Calibration, *_ONE.values(), *_MANY.values())
    if not isinstance(read.record, kinds):
        names = ", ".join(kind.__name__.lower() for kind in kinds)
        found = type(read.record).__name__.lower()
        raise InputError(
            f"expected a document that a page can show, found a {found} document",
            where=read.name,
            hint=f"kinds: {names}",
        )


def _components(reads: Sequence[Read]) -> list[list[Read]]:
    """Return the documents in groups, each in the order of its first one."""
    groups: list[list[Read]] = []
    for read in reads:
        near = [group for group in groups if any(_related(read, other) for other in group)]
        joined = [*(other for group in near for other in group), read]
        at = groups.index(near[0]) if near else len(groups)
        groups = [group for group in groups if group not in near]
        groups.insert(at, joined)
    return groups


def _related(a: Read, b: Read) -> bool:
    return a.root == b.root or _made_from(a, b) or _made_from(b, a)


def _made_from(later: Read, earlier: Read) -> bool:
    return earlier.sha256 in later.ancestors


def _cases(group: Sequence[Read]) -> Iterator[Case]:
    answers = [read for read in group if isinstance(read.record, Calibration)]
    others = [read for read in group if read not in answers]
    if not answers:
        yield _case(others, [])
    for answer in answers:
        yield _case([answer], [each for each in others if _fits(each, answer, answers)])


def _fits(read: Read, answer: Read, answers: Sequence[Read]) -> bool:
    """Return whether a document belongs to this answer, or at least to no other."""
    closest = [each for each in answers if _made_from(read, each) or _made_from(each, read)]
    return answer in closest or not closest


def _case(heads: Sequence[Read], others: Sequence[Read]) -> Case:
    reads = [*heads, *others]
    first = next((each for each in reads if each.asked), reads[0])
    slots: dict[str, Any] = {name: _only(reads, kind, heads[0]) for name, kind in _ONE.items()}
    for name, kind in _MANY.items():
        slots[name] = tuple(each.record for each in reads if isinstance(each.record, kind))
    answers = [each.record for each in heads if isinstance(each.record, Calibration)]
    return Case(
        name=first.name,
        files=tuple((each.name, each.sha256) for each in reads),
        calibration=answers[0] if answers else None,
        summary=next((each.summary for each in reads if each.summary is not None), None),
        **slots,
    )


def _only(reads: Sequence[Read], kind: type, head: Read) -> Any:
    """Return the record of a kind, the one that the head was made from if there are several."""
    found = [read for read in reads if isinstance(read.record, kind)]
    direct = [each for each in found if _made_from(head, each)] or found
    if len(direct) > 1:
        raise UsageError(
            f"expected one {kind.__name__.lower()} document for {head.name}, found "
            f"{len(direct)}: {', '.join(each.name for each in direct)}",
            hint="leave all but one out, or make a report of each",
        )
    return direct[0].record if direct else None
