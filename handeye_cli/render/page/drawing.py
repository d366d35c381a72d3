"""Figures as SVG inside a page: its fonts, its colours, no word of their own about themselves."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast

from handeye_cli.render.page.markup import text
from handeye_cli.render.page.palette import FAINT, GRID, INK, VARIABLES
from handeye_cli.render.text import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Size = tuple[float, float]

_FONT = "DejaVu Sans"
"""Letters are measured in it, since it comes with Matplotlib; the page sets them in its own."""
_LOOK: dict[str, Any] = {
    "svg.fonttype": "none",
    "font.family": _FONT,
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "xtick.color": FAINT,
    "ytick.color": FAINT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "text.color": INK,
    "text.parse_math": False,  # names come from outside
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "lines.linewidth": 1.5,
}
_NO_WORDS = {"Date": None, "Creator": None, "Format": None, "Type": None}
_DOTS = 150
"""Per inch, of the parts of a figure that are pixels."""
_LONGEST = 12
"""Signs of a name beside an axis."""


class Pen:
    """Draws the figures of a page.

    Args:
        page: Sets the names inside one page's figures apart from those of another's.
    """

    def __init__(self, page: str) -> None:
        self._page = page
        self._count = 0

    def draw(self, act: Callable[[Figure], None], size: Size, words: str) -> str:
        """Return a figure as an SVG element; the same text for the same figure.

        Args:
            act: Draws on the sheet.
            size: Width and height, inches.
            words: What it shows, for those who cannot see it.
        """
        from matplotlib import rc_context, style
        from matplotlib.figure import Figure

        self._count += 1
        look = cast(Any, _LOOK | {"svg.hashsalt": f"{self._page}-{self._count}"})
        stream = io.StringIO()
        with style.context("default"), rc_context(look), warnings.catch_warnings():
            # names are set by the browser, whatever signs Matplotlib's own font has
            warnings.filterwarnings("ignore", message="Glyph .* missing from")
            sheet = Figure(figsize=size, layout="constrained")
            act(sheet)
            sheet.savefig(stream, format="svg", transparent=True, dpi=_DOTS, metadata=_NO_WORDS)
        return _inline(stream.getvalue(), words)


def short(name: str) -> str:
    """Return a name from outside as it may stand in a figure."""
    shown = printable(name)
    return shown if len(shown) <= _LONGEST else f"{shown[: _LONGEST - 1]}…"


def _inline(svg: str, words: str) -> str:
    """Return the element of an SVG file as it may stand in a page, in the page's colours."""
    start = svg.index("<svg")
    width, height = re.findall(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', svg)[0]
    body = svg[svg.index(">", start) + 1 :]
    body = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", body, count=1, flags=re.DOTALL)
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r"<!--.*?-->", "", body, flags=re.DOTALL)
    body = re.sub(r' id="[a-zA-Z0-9.]+_\d+"', "", body)
    for colour, variable in VARIABLES.items():
        body = body.replace(colour, variable)
    body = body.replace(f"'{_FONT}'", "var(--font)").replace(f'"{_FONT}"', "var(--font)")
    return (
        f'<svg xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 {width} {height}" '
        f'role="img" aria-label="{text(words)}">{body.strip()}'
    )
