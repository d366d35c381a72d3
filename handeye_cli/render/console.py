"""What every report is printed with: the console, plain tables and the findings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TextIO

from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from handeye_cli.records import Finding
from handeye_cli.render.finding_lines import headline
from handeye_cli.render.text import printable

_WIDTH = 100
"""Columns a report is stretched over at most; it fits into 80."""

_STYLES = {"error": "bold red", "warning": "yellow", "info": "cyan"}


def make_console(stream: TextIO) -> Console:
    """Return a console on a stream that shows every text as it is, without markup or guessing."""
    console = Console(file=stream, markup=False, highlight=False, emoji=False)
    console.width = min(console.width, _WIDTH)
    return console


def show_table(
    console: Console, headings: Sequence[str], rows: Iterable[Sequence[str]], *, left: Sequence[int]
) -> None:
    """Print a table without lines, two columns indented, and a blank line.

    Args:
        console: Where to.
        headings: One per column; a line break puts the unit below the name.
        rows: Cells of every row. A column that has neither heading nor cells is left out.
        left: Columns of words, which start at the left; numbers end at the right.
    """
    cells = [[printable(cell) for cell in row] for row in rows]
    filled = [i for i, heading in enumerate(headings) if heading or any(row[i] for row in cells)]
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    for i in filled:
        words = i in left
        table.add_column(
            headings[i], justify="left" if words else "right", overflow="fold", no_wrap=not words
        )
    for row in cells:
        table.add_row(*(row[i] for i in filled))
    console.print(Padding(table, (0, 0, 0, 2), expand=False))
    console.print()


def show_findings(console: Console, findings: Iterable[Finding]) -> None:
    """Print findings, each with its advice below it: wrapped on a terminal, else a line for each.

    A file or pipe gets unbroken lines, so that they can be searched.
    """
    for finding in findings:
        _show_paragraph(console, headline(finding), _STYLES.get(finding.severity, ""), margin="")
        if finding.advice:
            _show_paragraph(console, printable(finding.advice), "", margin="  ")


def _show_paragraph(console: Console, text: str, style: str, margin: str) -> None:
    if console.is_terminal:
        console.print(Padding(Text(text, style), (0, 0, 0, len(margin)), expand=False))
    else:
        console.print(f"{margin}{text}", style=style, soft_wrap=True)
