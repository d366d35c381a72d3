"""What every report is printed with: the console, plain tables and the findings."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from textwrap import wrap
from typing import TextIO

from rich.cells import cell_len
from rich.console import Console
from rich.padding import Padding
from rich.table import Table

from handeye_cli.records import Finding
from handeye_cli.render.finding_lines import headline
from handeye_cli.render.text import printable

_WIDTH = 100
"""Columns a report is stretched over at most; it fits into 80."""

_TO_UNIT = re.compile(r"(?<=\d) (?=%|(?:m|mm|mil|mrad|deg|px|ms|s)\b)")
_JOINED = "\N{NO-BREAK SPACE}"
_INDENT = 2
_GAP = 2
_LABEL = 12
"""Columns of a word, or a name without blanks, from which on it is broken rather than the table."""

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

    Where its numbers and the words of its headings do not fit beside each other, every cell gets a
    line of its own, so that nothing is cut.

    Args:
        console: Where to.
        headings: One per column; a line break puts the unit below the name.
        rows: Cells of every row. A column that has neither heading nor cells is left out.
        left: Columns of words, which start at the left; numbers end at the right.
    """
    cells = [[printable(cell) for cell in row] for row in rows]
    filled = [i for i, heading in enumerate(headings) if heading or any(row[i] for row in cells)]
    columns = [[headings[i], *(row[i] for row in cells)] for i in filled]
    words = [i in left for i in filled]
    if _least_width(columns, words) > console.width:
        _show_lines(console, columns)
    else:
        _show_columns(console, columns, words)
    console.print()


def _least_width(columns: list[list[str]], words: list[bool]) -> int:
    """Return the width below which a table would cut numbers, or break most of its words."""
    widths = [
        max(_longest_word(column) if wraps else max(map(_widest, column)), _widest(column[0]))
        for column, wraps in zip(columns, words, strict=True)
    ]
    # words make room for a gap behind the last column, numbers do not
    return _INDENT + sum(widths) + _GAP * (len(widths) - (not words[-1]))


def _longest_word(column: list[str]) -> int:
    return min(max(cell_len(word) for cell in column for word in cell.split() or [""]), _LABEL)


def _widest(cell: str) -> int:
    return max(cell_len(line) for line in cell.split("\n"))


def _show_columns(console: Console, columns: list[list[str]], words: list[bool]) -> None:
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, _GAP, 0, 0))
    for column, wraps in zip(columns, words, strict=True):
        table.add_column(
            column[0], justify="left" if wraps else "right", overflow="fold", no_wrap=not wraps,
            min_width=_longest_word(column) if wraps else None,
        )  # fmt: skip
    for row in zip(*(column[1:] for column in columns), strict=True):
        table.add_row(*row)
    console.print(Padding(table, (0, 0, 0, _INDENT), expand=False))


def _show_lines(console: Console, columns: list[list[str]]) -> None:
    """Print every row as its first cell, and below it a line for each other cell with a text."""
    names = [column[0].replace("\n", " ").strip() for column in columns]
    for first, *others in zip(*(column[1:] for column in columns), strict=True):
        head = f"{names[0]} {first}".strip() if names[0] else first
        show_paragraph(console, head, margin=" " * _INDENT)
        for name, cell in zip(names[1:], others, strict=True):
            if cell:
                line = f"{name}: {cell}" if name else cell
                show_paragraph(console, line, margin=" " * (2 * _INDENT))


def show_findings(console: Console, findings: Iterable[Finding]) -> None:
    """Print findings, each with its advice below it: wrapped on a terminal, else a line for each.

    A file or pipe gets unbroken lines, so that they can be searched.
    """
    for finding in findings:
        show_paragraph(console, headline(finding), _STYLES.get(finding.severity, ""))
        if finding.advice:
            show_paragraph(console, printable(finding.advice), margin="  ")


def show_paragraph(console: Console, text: str, style: str = "", *, margin: str = "") -> None:
    """Print a sentence: wrapped on a terminal, no number apart from its unit; else as one line."""
    if not console.is_terminal:
        console.print(f"{margin}{text}", style=style, soft_wrap=True)
        return
    wide = max(console.width - len(margin), 1)
    for line in wrap(_TO_UNIT.sub(_JOINED, text), wide, break_on_hyphens=False):
        console.print(f"{margin}{line.replace(_JOINED, ' ')}", style=style)
