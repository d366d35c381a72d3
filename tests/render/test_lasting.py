"""The part of a report that tells what none of the listed steps changes."""

import io
from dataclasses import replace

from render.test_reports import calibration

from handeye_cli.records import Finding, Improvement
from handeye_cli.render.calibration import show_calibration
from handeye_cli.render.console import make_console

TOLD = "98 % of the mean square error in translation are no noise"
FOUND = Finding("robot-systematic", "warning", "a scale", "measure the target")


def report(*improvements):
    stream = io.StringIO()
    answer = calibration()
    answer = replace(
        answer,
        improvements=(*improvements, *answer.improvements),
        diagnosis=(*answer.diagnosis, FOUND),
    )
    show_calibration(answer, make_console(stream))
    return stream.getvalue().splitlines()


def test_it_stands_below_the_steps_with_what_would_help():
    lines = report(Improvement("lasting", "taking it away", 0.5e-3, 0.1e-3, TOLD))
    at = lines.index(f"  {TOLD}")
    assert lines[at + 1] == "  robot-systematic: measure the target"
    steps = [i for i, line in enumerate(lines) if line.strip().startswith("halving the camera")]
    assert steps[0] < at
    assert any(line.split() == ["taking", "it", "away", "0.500", "0.100"] for line in lines)


def test_findings_of_other_matters_are_not_repeated():
    assert not any("measure the target" in line for line in report())
    lines = report(Improvement("lasting", "taking it away", 0.5e-3, 0.1e-3, TOLD))
    assert not any("take it out" in line for line in lines)
