"""Findings as unbroken lines, for files and pipes; rich, which a terminal needs, stays unloaded."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from handeye_cli.records import Finding
from handeye_cli.render.text import printable


def headline(finding: Finding) -> str:
    """Return what was found, with its severity before it and its code behind it."""
    return f"{finding.severity}: {printable(finding.message)} [{finding.code}]"


def finding_lines(findings: Iterable[Finding]) -> Iterator[str]:
    """Yield a line for each finding and, two columns indented, one for its advice."""
    for finding in findings:
        yield headline(finding)
        if finding.advice:
            yield f"  {printable(finding.advice)}"
