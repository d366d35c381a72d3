"""What every benchmark gives: a table, as text, as Markdown and as JSON."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

_NONE = "-"


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes:
        name: Its head, with the unit.
        form: How its numbers are written, as in `format(number, form)`.
    """

    name: str
    form: str = ""

    def cell(self, value: Any) -> str:
        if value is None or (isinstance(value, float) and math.isnan(value)):
            return _NONE
        return value if isinstance(value, str) else format(value, self.form)


@dataclass(frozen=True)
class Table:
    """Results of one benchmark.

    Attributes:
        key: Its name in JSON.
        title: What it is about.
        columns: Its columns.
        rows: Its numbers and words, in the order of the columns; None where there is none.
        note: How to read it.
    """

    key: str
    title: str
    columns: tuple[Column, ...]
    rows: Sequence[Sequence[Any]]
    note: str = ""

    def text(self) -> str:
        """Return the table for a terminal."""
        lines = [self._heads(), *self._cells()]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        words = [isinstance(value, str) for value in self.rows[0]] if self.rows else []
        padded = [
            "  ".join(
                cell.ljust(width) if is_word else cell.rjust(width)
                for cell, width, is_word in zip(line, widths, words, strict=False)
            )
            for line in lines
        ]
        return "\n".join([self.title, *(line.rstrip() for line in padded)])

    def markdown(self) -> str:
        """Return the table as a section of a page."""
        rule = ["---" if form_is_word else "---:" for form_is_word in self._words()]
        lines = [_row(self._heads()), _row(rule), *map(_row, self._cells())]
        parts = [f"### {self.title}", *([self.note] if self.note else []), "\n".join(lines)]
        return "\n\n".join(parts)

    def as_json(self) -> dict[str, Any]:
        """Return the table with its numbers as they were measured."""
        names = self._heads()
        rows = [dict(zip(names, map(_known, row), strict=True)) for row in self.rows]
        return {"title": self.title, "rows": rows}

    def _heads(self) -> list[str]:
        return [column.name for column in self.columns]

    def _cells(self) -> list[list[str]]:
        pairs = [zip(self.columns, row, strict=True) for row in self.rows]
        return [[column.cell(value) for column, value in row] for row in pairs]

    def _words(self) -> list[bool]:
        return [column.form == "" for column in self.columns]


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def _known(value: Any) -> Any:
    """Return a value in JSON's types; it has no numbers that are none."""
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value if value is None or isinstance(value, int | str) else value.item()
