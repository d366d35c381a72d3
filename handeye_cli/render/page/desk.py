"""What the sections of a page are written with."""

from __future__ import annotations

from dataclasses import dataclass

from handeye_cli.render.page.drawing import Pen
from handeye_cli.render.page.telling import Teller


@dataclass(frozen=True)
class Desk:
    """Tools of one case of a page.

    Attributes:
        pen: For its figures.
        teller: For the words and tables of the terminal's reports.
    """

    pen: Pen
    teller: Teller
