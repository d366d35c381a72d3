"""What the data were found to say, the gravest first, with the next step of each."""

from __future__ import annotations

from handeye_cli.records import Finding
from handeye_cli.render.page.desk import Desk
from handeye_cli.render.page.markup import element, paragraph, text
from handeye_cli.reporting.contents import Contents

HEADING = "Findings"


def body(contents: Contents, _: Desk) -> str:
    """Return a list of all findings."""
    return element("ul", "".join(map(_item, contents.case.findings)), "found")


def _item(finding: Finding) -> str:
    badge = f'<span class="badge {text(finding.severity)}">{text(finding.severity)}</span>'
    code = element("code", text(finding.code))
    words = f"{badge} {text(finding.message)} {code}"
    return element("li", element("p", words) + paragraph(finding.advice, "advice"))
