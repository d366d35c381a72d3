"""How far each station and each point is from the answer and from its own pose."""

from __future__ import annotations

from typing import TYPE_CHECKING

from handeye_cli.records import Protocol, StationError, StationResidual
from handeye_cli.render.page.desk import Desk
from handeye_cli.render.page.figures.arrows import draw_image_arrows, draw_plate_arrows
from handeye_cli.render.page.figures.bars import draw_bars
from handeye_cli.render.page.figures.quantity import QUANTITIES, Quantity
from handeye_cli.render.page.markup import element, figure
from handeye_cli.render.text import pixels
from handeye_cli.reporting.contents import Contents
from handeye_cli.reporting.pixel_residuals import PixelResiduals

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEADING = "Residuals"

_BARS, _PLANE = (4.6, 2.4), (4.6, 3.7)
"""Width and height of figures, inches."""


def body(contents: Contents, desk: Desk) -> str:
    """Return residuals by station, over the image, and over the plate."""
    case = contents.case
    rows = case.calibration or case.inspection
    shown = ""
    if rows is not None and any(each.rotation is not None for each in rows.stations):
        left_out = _left_out(contents)
        shown += "".join(_bars(rows.stations, left_out, each, desk) for each in QUANTITIES)
    if contents.residuals is not None:
        shown += _arrows(contents.residuals, desk)
    return element("div", shown, "figures")


def _left_out(contents: Contents) -> dict[str, StationError]:
    """Return each station's error when it was left out, by its name."""
    return {
        error.name: error
        for each in contents.case.verifications
        if each.protocol is Protocol.LEAVE_ONE_OUT
        for row in each.rows
        for error in row.errors
    }


def _bars(
    stations: tuple[StationResidual, ...],
    left_out: dict[str, StationError],
    quantity: Quantity,
    desk: Desk,
) -> str:
    def act(sheet: Figure) -> None:
        draw_bars(sheet.add_subplot(), stations, left_out, quantity)

    words = f"Residual {quantity.name} of each station"
    dots = "; dots: its error when it takes no part in the calibration" if left_out else ""
    unused = not all(each.used for each in stations)
    cross = " A cross marks a station that was not used." if unused else ""
    return figure(desk.pen.draw(act, _BARS, words), f"{words}{dots}.{cross}")


def _arrows(residuals: PixelResiduals, desk: Desk) -> str:
    def over_image(sheet: Figure) -> None:
        draw_image_arrows(sheet.add_subplot(), residuals)

    def over_plate(sheet: Figure) -> None:
        draw_plate_arrows(sheet.add_subplot(), residuals)

    words = "Reprojection residuals over the image"
    rms = pixels(residuals.rms)
    image = f"{words}: their mean in every cell, {rms} px RMS. A pattern speaks against the lens."
    beside = "The same on the plate"
    plate = f"{beside}: the mean at every point. A pattern speaks against the plate's shape."
    return figure(desk.pen.draw(over_image, _PLANE, words), image) + figure(
        desk.pen.draw(over_plate, _PLANE, beside), plate
    )
