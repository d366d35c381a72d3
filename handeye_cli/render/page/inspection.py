"""What the data are fit for, as the terminal shows it."""

from __future__ import annotations

from handeye_cli.render.inspection import show_inspection
from handeye_cli.render.page.desk import Desk
from handeye_cli.render.recording_summary import show_recording_summary
from handeye_cli.reporting.contents import Contents

HEADING = "Inspection of the data"


def body(contents: Contents, desk: Desk) -> str:
    """Return the report of the inspection."""
    case, tell = contents.case, desk.teller.tell
    if case.inspection is not None:
        return tell(show_inspection, case.inspection)
    return "" if case.summary is None else tell(show_recording_summary, case.summary)
