"""Where to send the robot, in space and as tables."""

from __future__ import annotations

from handeye_cli.render.page.desk import Desk
from handeye_cli.render.page.layout import scene_figure
from handeye_cli.render.page.markup import element
from handeye_cli.render.plan import show_plan
from handeye_cli.reporting.contents import Contents

HEADING = "Plan"


def body(contents: Contents, desk: Desk) -> str:
    """Return every plan."""
    return "".join(
        element("div", scene_figure(scene, desk) + desk.teller.tell(show_plan, plan), "part")
        for plan, scene in zip(contents.case.plans, contents.plans, strict=True)
    )
