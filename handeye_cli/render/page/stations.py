"""Points and poses, station by station, as the terminal shows them."""

from __future__ import annotations

from handeye_cli.render.page.desk import Desk
from handeye_cli.render.page.markup import element
from handeye_cli.render.stations import show_features, show_stations
from handeye_cli.reporting.contents import Contents

HEADING = "Points and poses"


def body(contents: Contents, desk: Desk) -> str:
    """Return the reports of points and poses."""
    case, tell = contents.case, desk.teller.tell
    points = "" if case.features is None else tell(show_features, case.features)
    poses = "" if case.stations is None else tell(show_stations, case.stations)
    return element("div", points + poses, "beside")
