"""`handeye report`: one page for people, from any documents or a recording."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from handeye_cli.cli.camera_options import CameraFile
from handeye_cli.cli.inputs import Opened
from handeye_cli.cli.options import Intrinsics, Mcap, Output, Solver, Work
from handeye_cli.cli.outputs import STDOUT, check_output, print_text
from handeye_cli.cli.progress import steps
from handeye_cli.cli.report_inputs import Library, open_library
from handeye_cli.cli.report_options import Accepted, Page, Sources
from handeye_cli.errors import UsageError

if TYPE_CHECKING:
    from handeye_cli.gates import Limits
    from handeye_cli.pipeline import Steps
    from handeye_cli.reporting.case import Case
    from handeye_cli.reporting.contents import Contents
    from handeye_cli.reporting.verifying import Approach

EXAMPLES = (
    "handeye report calibration.yaml verification.yaml -o report.html",
    "handeye report data.mcap --target chessboard:9x6:23.6mm --setup eye-in-hand",
    "handeye report tonight.yaml --json -o tonight.html",
)


def report(
    *,
    sources: Sources,
    mcap: Mcap,
    camera_file: CameraFile,
    intrinsics: Intrinsics,
    solver: Solver,
    accepted: Accepted,
    work: Work,
    page: Page,
) -> None:
    """Write one page that anybody can open: the answer, a traffic light, tables and pictures.

    The input is a recording, which is calibrated and verified, or any documents. Those of one
    recording come together; files that a document was made from are taken along when they are
    still there. The page is a single file, for screens and paper, and loads nothing from anywhere.
    """
    from handeye_cli import gates, solvers
    from handeye_cli.pipeline import Steps
    from handeye_cli.render.sheet import require_matplotlib
    from handeye_cli.reporting.gathering import gather
    from handeye_cli.reporting.verifying import Approach

    _check_page(page)
    require_matplotlib()
    solvers.load(solver.method)
    limits = gates.Limits(accepted.max_rotation_mrad, accepted.max_translation_mm)
    library = open_library(sources, mcap, camera_file)
    cases = gather(library.reads)
    with steps(work, Output(quiet=page.quiet), intrinsics) as how:
        approach = Approach(how, solver.method, solver.pairs.value)
        cases = tuple(_complete(case, approach) for case in cases)
    show = Steps(workers=work.workers)
    every = [_contents(each, limits, show, library, images=not page.no_images) for each in cases]
    _write(every, page)
    _tell(every, page)
    _judge(cases, limits)


def _check_page(page: Page) -> None:
    """Refuse a page that could not be written, before any work is done for it.

    Raises:
        UsageError: Its file exists and is not to be replaced, or stdout is to have two things.
        InputError: Its folder does not exist.
    """
    if page.json and page.output == STDOUT:
        raise UsageError(
            "expected the page or --json on stdout, found both", hint="write the page to a file"
        )
    check_output(Output(output=page.output, force=page.force))


def _complete(case: Case, approach: Approach) -> Case:
    from handeye_cli.reporting.completing import complete

    with Opened(None, (case.name, "")).blamed():
        return complete(case, approach)


def _contents(
    case: Case, limits: Limits, how: Steps, library: Library, *, images: bool
) -> Contents:
    from handeye_cli.reporting.contents import contents_of

    unreached = library.unreached(case.provenance)
    with Opened(None, (case.name, "")).blamed():
        return contents_of(case, limits, how, images=images, unreached=unreached)


def _write(every: Sequence[Contents], page: Page) -> None:
    from handeye_cli import documents
    from handeye_cli.render.page.page import html_page
    from handeye_cli.reporting.contents import distances

    text = html_page(every, distances([each.case for each in every]))
    if page.output == STDOUT:
        print_text(text)
    else:
        documents.write_text(text, page.output, page.force)


def _tell(every: Sequence[Contents], page: Page) -> None:
    from handeye_cli.render.console import make_console, show_findings

    console = make_console(sys.stderr)
    for each in every:
        show_findings(console, each.case.findings)
    if page.json:
        print_text(_verdicts(every, page))
    elif page.output != STDOUT and not page.quiet:
        lights = ", ".join(each.light.colour.value for each in every if each.light)
        sys.stderr.write(f"written to {page.output}{f': {lights}' if lights else ''}\n")


def _verdicts(every: Sequence[Contents], page: Page) -> str:
    """Return the lights as JSON; a case with nothing to judge has none."""
    from handeye_cli.documents import layout

    cases = [
        {
            "name": each.case.name,
            "light": None if each.light is None else each.light.colour.value,
            "verified": None if each.light is None else each.light.verified,
            "reasons": [] if each.light is None else list(each.light.reasons),
        }
        for each in every
    ]
    return layout.dump({"page": page.output, "cases": cases}, "json")


def _judge(cases: Sequence[Case], limits: Limits) -> None:
    """Leave with the exit code of what is wrong, now that the page shows it.

    Raises:
        UndeterminedError: An answer was looked for, and there is none that means something.
        ConvergenceError: Its estimation did not settle.
        QualityGateError: An error is above its limit.
    """
    from handeye_cli import gates
    from handeye_cli.errors import QualityGateError
    from handeye_cli.reporting.light import broken_limits

    for case in cases:
        if case.attempted and case.inspection is not None:
            gates.require_meaning(case.inspection)
        if case.failure is not None:
            raise case.failure
    broken = [text for case in cases for text in broken_limits(case, limits)]
    if broken:
        raise QualityGateError("; ".join(broken))
