"""Findings without rich: the lines that a console prints into a file, to the letter."""

import io

import pytest

from handeye_cli.records import Finding
from handeye_cli.render.console import make_console, show_findings
from handeye_cli.render.finding_lines import finding_lines

LONG = "station [bold]07[/bold] is 12.3 mm away: " + "as far as nothing else " * 20
FINDINGS = [
    Finding("bad-station", "warning", LONG, "look at :smile: its picture\x1b[31m again"),
    Finding("pose-units", "error", "millimetres"),
    Finding("lengths", "info", "tab\tand µm", "take more"),
]


@pytest.mark.parametrize("findings", [FINDINGS, FINDINGS[1:2], []])
def test_lines_are_those_of_a_console_that_is_no_terminal(findings):
    stream = io.StringIO()
    show_findings(make_console(stream), findings)
    assert "".join(f"{line}\n" for line in finding_lines(findings)) == stream.getvalue()


def test_a_finding_is_a_line_with_its_advice_below():
    severity, text, advice = "warning", "two stations agree", "take more"
    lines = list(finding_lines([Finding("few", severity, text, advice)]))
    assert lines == ["warning: two stations agree [few]", "  take more"]
