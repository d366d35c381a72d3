"""Errors on stations that took no part: against the number of stations, and as tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from handeye_cli.records import Verification
from handeye_cli.render.page.desk import Desk
from handeye_cli.render.page.figures.counts import draw_counts
from handeye_cli.render.page.figures.quantity import QUANTITIES, Quantity
from handeye_cli.render.page.markup import element, figure, paragraph
from handeye_cli.render.verification import show_verification
from handeye_cli.reporting.contents import Contents

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEADING = "Verification"

_SIZE = (4.6, 2.9)
"""Width and height of a figure, inches."""


def body(contents: Contents, desk: Desk) -> str:
    """Return the figures, where there are several numbers of stations, and every table."""
    found = contents.case.verifications
    numbers = {row.stations for each in found for row in each.rows}
    shown = "".join(_figure(found, each, desk) for each in QUANTITIES) if len(numbers) > 1 else ""
    remarks = "".join(paragraph(each, "note") for each in contents.case.remarks)
    return (
        element("div", shown, "figures")
        + remarks
        + "".join(
            element("div", desk.teller.tell(show_verification, each), "part") for each in found
        )
    )


def _figure(found: tuple[Verification, ...], quantity: Quantity, desk: Desk) -> str:
    def act(sheet: Figure) -> None:
        draw_counts(sheet.add_subplot(), found, quantity)

    words = f"Held-out {quantity.name} error against the number of stations calibrated on"
    caption = f"{words}, and what was expected there. A ring is beyond chance."
    return figure(desk.pen.draw(act, _SIZE, words), caption)
