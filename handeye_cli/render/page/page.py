"""The page as a whole: one file, without scripts, that loads nothing from anywhere."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from handeye_cli import __version__
from handeye_cli.render.page.desk import Desk
from handeye_cli.render.page.drawing import Pen
from handeye_cli.render.page.markup import element, text
from handeye_cli.render.page.sections import sections
from handeye_cli.render.page.summary import summary
from handeye_cli.render.page.telling import Teller
from handeye_cli.reporting.contents import Contents, Distance

_STYLE = Path(__file__).with_name("page.css")
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""What a browser may load: nothing that is not in the page."""


def html_page(all_contents: Sequence[Contents], apart: Sequence[Distance | None]) -> str:
    """Return the page of one or several cases.

    Args:
        all_contents: What is shown of each.
        apart: How far each answer is from the first one.

    Raises:
        UsageError: Matplotlib is not installed.
    """
    names = ", ".join(each.case.name for each in all_contents)
    several = len(all_contents) > 1
    articles = "".join(
        _article(each, number, several) for number, each in enumerate(all_contents, start=1)
    )
    top = element("h1", "Hand-eye calibration") + element("p", text(names), "files")
    bottom = element("footer", element("p", text(f"made by handeye {__version__}")))
    return _document(
        text(f"Hand-eye calibration: {names}"),
        element("header", top) + summary(all_contents, apart) + articles + bottom,
    )


def _article(contents: Contents, number: int, several: bool) -> str:
    desk = Desk(Pen(str(number)), Teller())
    name = element("h1", text(contents.case.name), "case") if several else ""
    return element("article", name + "".join(sections(contents, desk)))


def _document(title: str, content: str) -> str:
    style = _STYLE.read_text(encoding="utf-8")
    return (
        "<!DOCTYPE html>\n"
        '<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        '<link rel="icon" href="data:,">\n'
        f"<title>{title}</title>\n<style>\n{style}</style>\n</head>\n"
        f"<body>\n<main>\n{content}</main>\n</body>\n</html>\n"
    )
