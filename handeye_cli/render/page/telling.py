"""The reports of the terminal as HTML: the same words and tables, each told once on a page."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

from rich.console import Console
from rich.padding import Padding
from rich.table import Table

from handeye_cli.render.page.markup import element, paragraph, table, text

_LONGEST_CAPTION = 90
"""Signs of a line that is a table's caption; a longer one is a paragraph."""


class Teller:
    """Tells records in the words of their reports, and nothing a second time."""

    def __init__(self) -> None:
        self._told: set[str] = set()

    def tell(self, show: Callable[[Any, Console], None], record: Any) -> str:
        """Return the report of a record as HTML, without the tables that were told before.

        Args:
            show: Prints it on a console.
            record: What is printed.
        """
        console = _PageConsole()
        show(record, console)
        fresh = [block for block in console.blocks() if block not in self._told]
        self._told.update(fresh)
        return element("div", "".join(fresh), "told")


class _PageConsole(Console):
    """A console that keeps what is printed on it as blocks of HTML.

    A line that stands right above a table is the table's caption.
    """

    def __init__(self) -> None:
        super().__init__(file=io.StringIO(), markup=False, highlight=False, emoji=False)
        self._blocks: list[str] = []
        self._line: tuple[str, str] | None = None

    def print(self, *objects: Any, **settings: Any) -> None:
        """Take lines of text, and tables as `show_table` makes them."""
        for each in objects:
            if isinstance(each, Padding) and isinstance(each.renderable, Table):
                self._take_table(each.renderable)
            else:
                self._take_line(str(each), settings)

    def blocks(self) -> list[str]:
        """Return all that was printed."""
        self._end_line()
        return self._blocks

    def _take_table(self, printed: Table) -> None:
        columns = printed.columns
        words = [i for i, column in enumerate(columns) if column.justify == "left"]
        cells = [[str(cell) for cell in column.cells] for column in columns]
        caption = self._caption()
        headings = [str(column.header) for column in columns]
        rows = zip(*cells, strict=True)
        self._blocks.append(table(headings, rows, words=words, caption=caption))

    def _caption(self) -> str:
        if self._line is None or len(self._line[0]) > _LONGEST_CAPTION:
            self._end_line()
            return ""
        (caption, _), self._line = self._line, None
        return caption

    def _take_line(self, line: str, settings: dict[str, Any]) -> None:
        self._end_line()
        if settings.get("style") == "bold":
            self._blocks.append(element("p", text(_joined(line)), "lead"))
        elif line.startswith("  ") and settings.get("soft_wrap"):
            self._blocks.append(paragraph(line.rstrip(), "kept"))
        elif line.strip():
            self._line = (_joined(line), "note" if line.startswith("  ") else "")

    def _end_line(self) -> None:
        if self._line is not None:
            self._blocks.append(paragraph(*self._line))
            self._line = None


def _joined(line: str) -> str:
    """Return lines that were broken to fit a terminal as one."""
    return " ".join(line.split())
