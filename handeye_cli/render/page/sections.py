"""The sections of a page in their order; each is a module with a HEADING and a `body`."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module

from handeye_cli.render.page.desk import Desk
from handeye_cli.render.page.markup import element, text
from handeye_cli.reporting.contents import Contents

SECTIONS = {
    "verdict": "handeye_cli.render.page.verdict",
    "batch": "handeye_cli.render.page.batch",
    "findings": "handeye_cli.render.page.findings",
    "layout": "handeye_cli.render.page.layout",
    "answer": "handeye_cli.render.page.answer",
    "verification": "handeye_cli.render.page.verification",
    "residuals": "handeye_cli.render.page.residuals",
    "images": "handeye_cli.render.page.images",
    "stations": "handeye_cli.render.page.stations",
    "inspection": "handeye_cli.render.page.inspection",
    "plan": "handeye_cli.render.page.plan",
    "simulation": "handeye_cli.render.page.simulation",
    "provenance": "handeye_cli.render.page.provenance",
}
"""Names of the sections, with their modules; one without anything to show is left out."""


def sections(contents: Contents, desk: Desk) -> Iterator[str]:
    """Yield the sections of a case that have something to show."""
    for name, home in SECTIONS.items():
        module = import_module(home)
        body = module.body(contents, desk)
        if body:
            heading = element("h2", text(module.HEADING))
            yield f'<section class="{name}">\n{heading}{body}</section>\n'
