"""What the data are fit for, as the terminal shows it."""

from __future__ import annotations

from handeye_cli.render.inspection import show_inspection
from handeye_cli.render.page.desk import Desk
from handeye_cli.reporting.contents import Contents

HEADING = "Inspection of the data"


def body(contents: Contents, desk: Desk) -> str:
    """Return the report of the inspection."""
    found = contents.case.inspection
    return "" if found is None else desk.teller.tell(show_inspection, found)
