"""Many recordings in a table, each with its own light, and what is not as it should be."""

from __future__ import annotations

from collections.abc import Sequence

from handeye_cli.records.batch import Batch
from handeye_cli.render.batch import BATCH_NOTE, batch_cells, batch_headings, complaints, summary
from handeye_cli.render.page.desk import Desk
from handeye_cli.render.page.markup import bullets, element, lamp, paragraph, table, text
from handeye_cli.render.text import NOTHING
from handeye_cli.reporting.batch_light import RowLight
from handeye_cli.reporting.contents import Contents

HEADING = "Recordings"

_LEGEND = (
    "Red: no answer, or none that could be verified, or an error above a limit. Amber: an answer "
    "with something to look at, or a recording that was not done. Green: an answer whose errors at "
    "stations that took no part are as predicted. Exit codes: 0 done, 1 a bug, 2 wrong usage, 3 "
    "bad input, 4 the data do not determine the answer, 5 not converged, 6 a limit was missed, 130 "
    "interrupted."
)


def body(contents: Contents, _: Desk) -> str:
    """Return the table and the complaints of every batch."""
    return "".join(
        element("div", _batch(batch, lights), "part")
        for batch, lights in zip(contents.case.batches, contents.batches, strict=True)
    )


def _batch(batch: Batch, lights: Sequence[RowLight]) -> str:
    first, *others = batch_headings(batch)
    kept = any(row.calibration for row in batch.rows)
    headings = [first, "light", *others, *(["calibration"] if kept else [])]
    rows = [_row(light, batch, kept=kept) for light in lights]
    words = [0, 1, 2, len(others) + 2]
    return (
        paragraph(summary(batch), "lead")
        + paragraph(f"{BATCH_NOTE}.", "note")
        + table(headings, rows, words=words)
        + paragraph(_LEGEND, "note")
        + element("ul", "".join(map(_item, lights)), "found")
    )


def _row(light: RowLight, batch: Batch, *, kept: bool) -> list[str]:
    name, *others = batch_cells(light.row, batch)
    calibration = [light.row.calibration or NOTHING] if kept else []
    return [name, lamp(light.colour, "small"), *others, *calibration]


def _item(light: RowLight) -> str:
    """Return what is wrong with one recording; nothing where all is well."""
    wrong = (*complaints(light.row), *light.broken)
    if not wrong:
        return ""
    name = element("p", f"{lamp(light.colour, 'small')} <strong>{text(light.row.name)}</strong>")
    return element("li", name + bullets(wrong) + paragraph(light.row.advice or "", "advice"))
