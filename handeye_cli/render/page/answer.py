"""The calibration in numbers, as the terminal shows it."""

from __future__ import annotations

from handeye_cli.render.calibration import show_calibration
from handeye_cli.render.page.desk import Desk
from handeye_cli.reporting.contents import Contents

HEADING = "The answer in numbers"


def body(contents: Contents, desk: Desk) -> str:
    """Return the report of the calibration."""
    answer = contents.case.calibration
    return "" if answer is None else desk.teller.tell(show_calibration, answer)
