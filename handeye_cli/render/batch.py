"""The report of a batch: the recordings in a table, the worst on top, and what is wrong below."""

from __future__ import annotations

from collections.abc import Iterator

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
BATCH_NOTE = "Errors as RMS: predicted of the answer, seen at stations that took no part"
"""What the numbers of the table are."""
_STYLES = {BatchStatus.FAILED: "bold red", BatchStatus.GATE: "bold red"}


def show_batch(batch: Batch, console: Console) -> None:
    """Print the table and, below it, what is not as it should be."""
    console.print(f"{summary(batch)}", style="bold")
    console.print(f"{BATCH_NOTE}\n")
    rows = (batch_cells(row, batch) for row in batch.worst_first())
    show_table(console, batch_headings(batch), rows, left=[0, 1])
    show_complaints(batch, console)


def show_complaints(batch: Batch, console: Console) -> None:
    """Print why recordings failed and what else is to be looked at, on lines never broken."""
    for row in batch.worst_first():
        for text in complaints(row):
            line = f"{row.status}: {printable(row.name)}: {printable(text)}"
            console.print(line, style=_STYLES.get(row.status, "yellow"), soft_wrap=True)
        if row.advice:
            console.print(f"  {printable(row.advice)}", soft_wrap=True)


def summary(batch: Batch) -> str:
    """Return how many recordings went how: `3 recordings: 1 failed, 2 ok`."""
    counts = [(batch.count(status), word) for status, word in _WORDS.items()]
    told = ", ".join(f"{number} {word}" for number, word in counts if number)
    return f"{count(len(batch.rows), 'recording')}: {told}"


def batch_headings(batch: Batch) -> list[str]:
    """Return the headings of the table; the last one only where times are known."""
    headings = ["recording", "status", "exit", "stations\nused", "predicted\nmrad", "\nmm"]
    return [*headings, "seen\nmrad", "\nmm", *(["time\ns"] if _is_timed(batch) else [])]


def batch_cells(row: BatchRow, batch: Batch) -> list[str]:
    """Return the cells below the headings for one recording."""
    used = NOTHING if row.used is None else str(row.used)
    seconds = NOTHING if row.seconds is None else f"{row.seconds:.1f}"
    return [
        row.name,
        row.status.value,
        str(row.exit_code),
        NOTHING if row.stations is None else f"{used}/{row.stations}",
        mrad(row.predicted_rotation),
        mm(row.predicted_translation),
        mrad(row.seen_rotation),
        mm(row.seen_translation),
        *([seconds] if _is_timed(batch) else []),
    ]


def _is_timed(batch: Batch) -> bool:
    return any(row.seconds is not None for row in batch.rows)


def complaints(row: BatchRow) -> Iterator[str]:
    """Yield why a recording failed, and what else is to be looked at."""
    if row.message:
        yield row.message
    if row.findings:
        yield ", ".join(row.findings)
    if row.consistent is False:
        yield "the errors seen contradict the prediction, beyond chance"
