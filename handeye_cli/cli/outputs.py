"""Where a result goes: a file, stdout as a document, or the terminal as a report.

With `-o` the document goes to the file. Without it a pipe gets the document and a terminal the
report. Findings go to stderr in every case.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from handeye_cli import __version__
from handeye_cli.cli.inputs import Opened
from handeye_cli.cli.options import Output
from handeye_cli.errors import InputError

STDOUT = "-"

Traced = TypeVar("Traced", bound=Any)


def check_output(output: Output) -> None:
    """Refuse a file that could not be written, before any work is done for it.

    Raises:
        UsageError: It exists and is not to be replaced.
        InputError: Its folder does not exist.
    """
    if output.output is None or output.output == STDOUT:
        return
    from handeye_cli import documents

    documents.check_destination(output.output, output.force)


def finish(
    command: str,
    record: Any,
    output: Output,
    inputs: Sequence[Opened],
    flags: Mapping[str, Any],
) -> None:
    """Add the step to the record's provenance, then write, print or show it.

    Args:
        command: Name of the command.
        record: Its result.
        output: Where it goes.
        inputs: What was read; the provenance of the first goes on in the result.
        flags: The flags that were given.
    """
    record = with_step(record, command, inputs, flags)
    if not deliver(record, output) and sys.stdout.isatty() and not output.quiet:
        _show_report(record)
    show_findings(record)


def with_step(
    record: Traced, command: str, inputs: Sequence[Opened], flags: Mapping[str, Any]
) -> Traced:
    """Return a record that knows by which command it was made last; see `finish`."""
    from handeye_cli.records import ProvenanceStep

    files = tuple(file for each in inputs for file in each.files)
    step = ProvenanceStep(command, __version__, files, flags)
    before = inputs[0].record.provenance if inputs else ()
    return replace(record, provenance=(*before, step))


def deliver(record: Any, output: Output) -> bool:
    """Write the document to its file or to stdout, and return whether stdout has it now."""
    from handeye_cli import documents

    if output.output is not None and output.output != STDOUT:
        documents.write(record, output.output, output.force)
    if output.json:
        print_text(documents.dump(record, "json"))
    elif output.output == STDOUT or (output.output is None and not sys.stdout.isatty()):
        print_text(documents.dump(record, "yaml"))
    else:
        return False
    return True


def print_text(text: str) -> None:
    """Write text to stdout."""
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except OSError as error:
        # What is left in the buffer would fail once more when Python closes the stream.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise InputError(f"cannot be written: {error.strerror}", where="standard output") from error


def _show_report(record: Any) -> None:
    from handeye_cli.render.console import make_console
    from handeye_cli.render.report import show

    show(record, make_console(sys.stdout))


def show_findings(record: Any, *, notes: bool = True) -> None:
    """Tell on stderr what was found about a record's data, with notes or only what is wrong."""
    from handeye_cli.pipeline import findings_of

    found = [each for each in findings_of(record) if notes or each.severity != "info"]
    if not found:
        return
    if sys.stderr.isatty() or "FORCE_COLOR" in os.environ:
        from handeye_cli.render import console

        console.show_findings(console.make_console(sys.stderr), found)
    else:
        from handeye_cli.render.finding_lines import finding_lines

        sys.stderr.writelines(f"{line}\n" for line in finding_lines(found))
