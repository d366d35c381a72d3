"""The report of a batch: the recordings in a table, the worst on top, and what is wrong below."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console

from handeye_cli.records.batch import Batch, BatchRow, BatchStatus
from handeye_cli.render.console import show_table
from handeye_cli.render.text import NOTHING, count, mm, mrad, printable

_WORDS = {
    BatchStatus.FAILED: "failed",
    BatchStatus.GATE: "missed a limit",
    BatchStatus.CANCELLED: "cancelled",
    BatchStatus.WARNINGS: "with warnings",
    BatchStatus.OK: "ok",
}
_STYLES = {BatchStatus.FAILED: "bold red", BatchStatus.GATE: "bold red"}


def show_batch(batch: Batch, console: Console) -> None:
    """Print the table and, below it, what is not as it should be."""
    console.print(f"{summary(batch)}", style="bold")
    console.print("Errors as RMS: predicted of the answer, seen at stations that took no part\n")
    timed = any(row.seconds is not None for row in batch.rows)
    headings = ["recording", "status", "exit", "stations\nused", "predicted\nmrad", "\nmm"]
    headings += ["seen\nmrad", "\nmm", "time\ns" if timed else ""]
    rows = (_cells(row, timed) for row in batch.worst_first())
    show_table(console, headings, rows, left=[0, 1])
    show_complaints(batch, console)


def show_complaints(batch: Batch, console: Console) -> None:
    """Print why recordings failed and what else is to be looked at, on lines never broken."""
    for row in batch.worst_first():
        for text in _complaints(row):
            line = f"{row.status}: {printable(row.name)}: {printable(text)}"
            console.print(line, style=_STYLES.get(row.status, "yellow"), soft_wrap=True)
        if row.advice:
            console.print(f"  {printable(row.advice)}", soft_wrap=True)


def summary(batch: Batch) -> str:
    """Return how many recordings went how: `3 recordings: 1 failed, 2 ok`."""
    counts = [(batch.count(status), word) for status, word in _WORDS.items()]
    told = ", ".join(f"{number} {word}" for number, word in counts if number)
    return f"{count(len(batch.rows), 'recording')}: {told}"


def _cells(row: BatchRow, timed: bool) -> list[str]:
    used = NOTHING if row.used is None else str(row.used)
    return [
        row.name,
        row.status.value,
        str(row.exit_code),
        NOTHING if row.stations is None else f"{used}/{row.stations}",
        mrad(row.predicted_rotation),
        mm(row.predicted_translation),
        mrad(row.seen_rotation),
        mm(row.seen_translation),
        f"{row.seconds:.1f}" if timed and row.seconds is not None else "",
    ]


def _complaints(row: BatchRow) -> Iterable[str]:
    if row.message:
        yield row.message
    if row.findings:
        yield ", ".join(row.findings)
    if row.consistent is False:
        yield "the errors seen are larger than predicted, beyond chance"
