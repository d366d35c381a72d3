"""How it all came about: commands, their flags, and the digests of the files."""

from __future__ import annotations

from handeye_cli.records import ProvenanceStep
from handeye_cli.render.page.desk import Desk
from handeye_cli.render.page.markup import table
from handeye_cli.reporting.contents import Contents

HEADING = "How it came about"


def body(contents: Contents, _: Desk) -> str:
    """Return the steps to the answer, and the files of this case."""
    case = contents.case
    files = table(["file", "SHA-256"], case.files, words=[0, 1], caption="Files of this report")
    if not case.provenance:
        return files
    headings = ["command", "version", "input", "flags"]
    rows = [_row(step) for step in case.provenance]
    return table(headings, rows, words=range(4), caption="Commands that led here") + files


def _row(step: ProvenanceStep) -> list[str]:
    inputs = ", ".join(name for name, _ in step.inputs)
    flags = ", ".join(
        name if value is True else f"{name}: {value}" for name, value in step.options.items()
    )
    return [step.command, step.version, inputs, flags]
