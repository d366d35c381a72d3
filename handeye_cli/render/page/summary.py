"""Several answers side by side."""

from __future__ import annotations

from collections.abc import Sequence

from handeye_cli.records import PredictedError, VerificationRow
from handeye_cli.render.page.markup import element, table
from handeye_cli.render.text import NOTHING, mm, mrad
from handeye_cli.reporting.contents import Contents, Distance

_HEADINGS = [
    "case",
    "light",
    "method",
    "stations",
    "predicted\nmrad",
    "\nmm",
    "seen\nmrad",
    "\nmm",
    "apart\nmrad",
    "\nmm",
]


def summary(all_contents: Sequence[Contents], apart: Sequence[Distance | None]) -> str:
    """Return a table of the cases that are judged; nothing for fewer than two."""
    judged = [pair for pair in zip(all_contents, apart, strict=True) if pair[0].light]
    if len(judged) < 2:
        return ""
    rows = [_row(each, distance) for each, distance in judged]
    caption = "Side by side; apart: from the first answer"
    return element("section", table(_HEADINGS, rows, words=[0, 1, 2], caption=caption), "summary")


def _row(contents: Contents, apart: Distance | None) -> list[str]:
    case, answer = contents.case, contents.case.calibration
    error = None if answer is None else answer.predicted_error
    seen = None if contents.seen is None else contents.seen[1]
    return [
        case.name,
        NOTHING if contents.light is None else contents.light.colour.value,
        NOTHING if answer is None else answer.method,
        NOTHING if answer is None else str(sum(each.used for each in answer.stations)),
        *_error(error),
        *_error(seen),
        *_error(apart),
    ]


def _error(of: PredictedError | VerificationRow | Distance | None) -> list[str]:
    return [NOTHING, NOTHING] if of is None else [mrad(of.rotation), mm(of.translation)]
