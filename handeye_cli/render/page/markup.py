"""Pieces of HTML; every text from outside is made harmless here."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterable, Sequence

from handeye_cli.render.text import printable


class Markup(str):
    """A cell of a table that is markup already."""

    __slots__ = ()


def text(words: str) -> str:
    """Return text as it may stand in an element or an attribute."""
    return html.escape(printable(words))


def element(tag: str, content: str, css: str = "") -> str:
    """Return an element around markup that is finished; nothing for no content.

    Args:
        tag: Such as `p`.
        content: Markup.
        css: Names of its classes.
    """
    names = f' class="{css}"' if css else ""
    return f"<{tag}{names}>{content}</{tag}>\n" if content else ""


def paragraph(words: str, css: str = "") -> str:
    """Return a paragraph of text; nothing for no words."""
    return element("p", text(words), css)


def lamp(colour: str, css: str = "") -> Markup:
    """Return a lamp of a traffic light with the name of its colour in it.

    Args:
        colour: `red`, `amber` or `green`.
        css: Names of further classes.
    """
    return Markup(f'<span class="{" ".join(["lamp", colour, css]).strip()}">{colour}</span>')


def bullets(items: Iterable[str], css: str = "") -> str:
    """Return a list of texts."""
    return element("ul", "".join(element("li", text(item)) for item in items), css)


def table(
    headings: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    words: Sequence[int],
    caption: str = "",
) -> str:
    """Return a table that scrolls where it is wider than the page.

    Args:
        headings: One per column; a line break puts the unit below the name.
        rows: Cells of every row.
        words: Columns of words, which start at the left; numbers end at the right.
        caption: What it shows.
    """
    look = ["" if i in words else ' class="n"' for i in range(len(headings))]
    head = "".join(
        f'<th scope="col"{css}>{_lines(cell)}</th>'
        for css, cell in zip(look, headings, strict=True)
    )
    body = "".join(_row(row, look) for row in rows)
    top = f"<thead><tr>{head}</tr></thead>\n" if any(headings) else ""
    label = f' aria-label="{text(caption)}"' if caption else ""
    inner = f"<table{label}>{top}{element('tbody', body)}</table>"
    # above the part that scrolls, and not broken to the width of a narrow table
    return element("div", paragraph(caption, "caption") + element("div", inner, "scroll"), "table")


def _row(row: Sequence[str], look: Sequence[str]) -> str:
    cells = "".join(
        f"<td{css}>{_cell(cell)}</td>" for css, cell in zip(look[1:], row[1:], strict=True)
    )
    return f'<tr><th scope="row"{look[0]}>{_cell(row[0])}</th>{cells}</tr>\n'


def _cell(cell: str) -> str:
    return cell if isinstance(cell, Markup) else text(cell)


def _lines(cell: str) -> str:
    return "<br>".join(text(line) for line in cell.split("\n"))


def figure(picture: str, caption: str, css: str = "") -> str:
    """Return a picture with its caption; nothing without a picture."""
    return element("figure", picture + element("figcaption", text(caption)), css) if picture else ""


def image(data: bytes, kind: str, words: str) -> str:
    """Return an image that stands in the page itself.

    Args:
        data: The file.
        kind: Such as `png`.
        words: What it shows, for those who cannot see it.
    """
    code = base64.b64encode(data).decode("ascii")
    return f'<img alt="{text(words)}" src="data:image/{kind};base64,{code}">'
