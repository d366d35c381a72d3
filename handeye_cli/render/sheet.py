"""A sheet of Matplotlib as a PNG, the same bytes for the same drawing.

Matplotlib is an extra of the project and is loaded only when something is drawn.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import TYPE_CHECKING

from handeye_cli.errors import UsageError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DOTS = 95
"""Per inch."""


def require_matplotlib() -> None:
    """Refuse to draw without Matplotlib, before any work is done for a picture.

    Raises:
        UsageError: It is not installed.
    """
    try:
        import matplotlib  # noqa: F401 - whether it is there is all that is asked
    except ModuleNotFoundError as error:
        raise UsageError(
            f"expected Matplotlib to draw with, found no module {error.name!r}",
            hint='install it with: pip install "handeye-cli[plot]"',
        ) from error


def sheet_png(size: tuple[float, float], draw: Callable[[Figure], None]) -> bytes:
    """Return what is drawn on a sheet.

    Args:
        size: Width and height, inches.
        draw: Draws on the sheet.

    Raises:
        UsageError: Matplotlib is not installed.
    """
    require_matplotlib()
    from matplotlib import style
    from matplotlib.figure import Figure

    stream = io.BytesIO()
    with style.context("default"):  # not that of the user's own pictures
        sheet = Figure(figsize=size, dpi=_DOTS, layout="constrained")
        draw(sheet)
        # without the name of the software, which holds its version
        sheet.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()
