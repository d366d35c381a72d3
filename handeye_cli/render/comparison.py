"""The report of a comparison: what every method says, side by side."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console

from handeye_cli.records import Comparison
from handeye_cli.render.console import show_table
from handeye_cli.render.text import mm, mrad, printable

_HEADINGS = [
    "method",
    "apart\nmrad",
    "\nmm",
    "predicted\nmrad",
    "\nmm",
    "held out\nmrad",
    "\nmm",
]


def show_comparison(rows: Sequence[Comparison], console: Console) -> None:
    """Print the rows of a comparison, and below them why some of it is missing."""
    show_table(console, _HEADINGS, map(_cells, rows), left=[0])
    reasons = [f"{row.method}: {printable(row.reason)}" for row in rows if row.reason]
    for reason in reasons:
        console.print(f"  {reason}", soft_wrap=True)
    if reasons:
        console.print()


def _cells(row: Comparison) -> list[str]:
    return [
        row.method,
        mrad(row.rotation),
        mm(row.translation),
        mrad(row.predicted_rotation),
        mm(row.predicted_translation),
        mrad(row.held_out_rotation),
        mm(row.held_out_translation),
    ]
